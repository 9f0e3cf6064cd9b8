/**
 * Bundles the page into server/tryon_server/web, from where the server hands it out at `/`, or into the folder given as
 * the only argument.
 *
 * Everything is inside: no other host is asked for anything. Scripts and styles carry a hash of their content in their
 * name, so that a browser never mixes two builds; only index.html keeps its name.
 */
import { build } from "esbuild";
import { mkdir, readdir, readFile, rm, writeFile } from "node:fs/promises";
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
  legalComments: "none",
  metafile: true,
  logLevel: "warning",
};

/** The licences of the packages that went into the bundles, which their terms want to go along. */
async function licences(...results) {
  const inputs = results.flatMap((result) => Object.keys(result.metafile.inputs));
  const packages = inputs.map((path) => /^(.*node_modules\/(?:@[^/]+\/)?[^/]+)\//.exec(path)?.[1]).filter(Boolean);
  const texts = [...new Set(packages)].sort().map(async (folder) => {
    const { name, version, license } = JSON.parse(await readFile(join(folder, "package.json"), "utf8"));
    const file = (await readdir(folder)).find((entry) => /^licen[cs]e/i.test(entry));
    return `${name} ${version} (${license})\n\n${file ? await readFile(join(folder, file), "utf8") : ""}`;
  });
  return (await Promise.all(texts)).join(`\n${"-".repeat(80)}\n\n`);
}

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
await writeFile(join(out, "licences.txt"), await licences(worker, page));
