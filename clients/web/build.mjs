/**
 * Bundles the page into server/tryon_server/web, from where the server hands it out at `/`, or into the folder given as
 * the only argument.
 *
 * Everything is inside: no other host is asked for anything. Scripts and styles carry a hash of their content in their
 * name, so that a browser never mixes two builds; only index.html keeps its name.
 */
import { build } from "esbuild";
import { mkdir, readFile, rm, writeFile } from "node:fs/promises";
import { basename, dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const out = resolve(process.argv[2] ?? join(here, "../../server/tryon_server/web"));

const common = {
  bundle: true,
  minify: true,
  format: "esm",
  target: ["es2022"],
  outdir: join(out, "assets"),
  entryNames: "[name]-[hash]",
  legalComments: "linked",
  metafile: true,
  logLevel: "warning",
};

/** The file that esbuild wrote for the entry point that ends in `source`. */
function written(result, source) {
  for (const [path, output] of Object.entries(result.metafile.outputs)) {
    if (output.entryPoint?.endsWith(source)) return basename(path);
  }
  throw new Error(`the build wrote nothing for ${source}`);
}

await rm(join(out, "assets"), { recursive: true, force: true }); // what an earlier build left; nothing else in the folder
await mkdir(out, { recursive: true });
const worker = await build({ ...common, entryPoints: [join(here, "../core/src/worker.ts")] });
const page = await build({
  ...common,
  entryPoints: [join(here, "src/main.ts"), join(here, "src/style.css")],
  define: { WORKER_FILE: JSON.stringify(written(worker, "worker.ts")) },
});
const html = await readFile(join(here, "src/index.html"), "utf8");
await writeFile(
  join(out, "index.html"),
  html.replace("{{main}}", `assets/${written(page, "main.ts")}`).replace("{{style}}", `assets/${written(page, "style.css")}`),
);
