import assert from "node:assert/strict";
import { test } from "node:test";

import { Api, RequestError } from "../../clients/core/src/rest.ts";

interface Asked {
  readonly url: string;
  readonly method: string | undefined;
  readonly body: unknown;
}

/** An API whose server answers everything with this reply; `asked` lists what it was asked. */
function answering(status: number, body: string): { api: Api; asked: Asked[] } {
  const asked: Asked[] = [];
  const fetcher: typeof fetch = (input, init) => {
    asked.push({ url: new Request(input).url, method: init?.method, body: init?.body });
    return Promise.resolve(new Response(status === 204 ? null : body, { status }));
  };
  return { api: new Api(new URL("http://example.test/try/"), fetcher), asked };
}

test("a session is asked for with what was wished, and its stream lies beside the page", async () => {
  const { api, asked } = answering(201, JSON.stringify({ id: "a b", stream: "/api/sessions/a%20b/stream" }));
  const session = await api.openSession({ garment: "tshirt", motion: "walk", fabric: null, preset: null, size: 0.9, body: null });
  assert.deepEqual(asked, [
    {
      url: "http://example.test/try/api/sessions",
      method: "POST",
      body: '{"garment":"tshirt","motion":"walk","fabric":null,"preset":null,"size":0.9,"body":null}',
    },
  ]);
  assert.equal(api.streamUrl(session), "ws://example.test/try/api/sessions/a%20b/stream");
});

test("a mesh is sent with the unit, axis and rest shape that were told, and nothing where none was", async () => {
  const { api, asked } = answering(201, JSON.stringify({ id: "p1", notes: ["units and axes: cm, Z up"] }));
  const mesh = new Blob(["v 0 0 0"]);
  const garment = await api.uploadGarment(mesh, "skirt", { units: "cm", up: null, restShape: "shape" });
  await api.uploadGarment(mesh, "skirt");
  assert.deepEqual(garment.notes, ["units and axes: cm, Z up"]);
  assert.deepEqual(
    asked.map(({ url }) => url),
    ["http://example.test/try/api/garments?name=skirt&units=cm&rest_shape=shape", "http://example.test/try/api/garments?name=skirt"],
  );
});

test("motions and bodies are sent with what was told about them", async () => {
  const { api, asked } = answering(201, "{}");
  await api.uploadMotion(new Blob(["HIERARCHY"]), "my dance", { units: "mm", up: "-y", facing: "-z", joints: ["head=Top of it", "pelvis=Root"] });
  await api.uploadMotion(new Blob(["HIERARCHY"]), "my dance");
  await api.uploadBody(new Blob(["PK"]), "actor", { units: "cm", up: "x", fps: 24, animation: "walk 2", facing: "-y" });
  await api.removeBody("actor-1");
  await api.removeMotion("my_dance-1");
  await api.removeGarment("p1");
  assert.deepEqual(
    asked.map(({ url, method }) => `${method} ${url}`),
    [
      "POST http://example.test/try/api/motions?name=my+dance&units=mm&up=-y&facing=-z&joint=head%3DTop+of+it&joint=pelvis%3DRoot",
      "POST http://example.test/try/api/motions?name=my+dance",
      "POST http://example.test/try/api/bodies?name=actor&units=cm&up=x&fps=24&animation=walk+2&facing=-y",
      "DELETE http://example.test/try/api/bodies/actor-1",
      "DELETE http://example.test/try/api/motions/my_dance-1",
      "DELETE http://example.test/try/api/garments/p1",
    ],
  );
});

test("names are escaped", async () => {
  const { api, asked } = answering(204, "");
  await api.endSession("a/../b");
  assert.equal(asked[0].url, "http://example.test/try/api/sessions/a%2F..%2Fb");
});

test("a refusal keeps the server's place and remedy", async () => {
  const reply = { code: "pattern.invalid", place: "panels.front.edges[3]", message: "not a number", remedy: "Correct it" };
  const { api } = answering(422, JSON.stringify(reply));
  await assert.rejects(api.uploadGarment(new Blob(["{}"]), "coat"), (error) => {
    assert.ok(error instanceof RequestError);
    assert.deepEqual([error.message, error.place, error.remedy, error.status], ["not a number", "panels.front.edges[3]", "Correct it", 422]);
    return true;
  });
});

test("an error page of something in between is told as such", async () => {
  const { api } = answering(502, "<html>Bad gateway</html>");
  await assert.rejects(api.garments(), (error) => error instanceof RequestError && error.status === 502 && error.message.includes("502"));
});

test("a server that does not answer is told as such", async () => {
  const api = new Api(new URL("http://example.test/"), () => Promise.reject(new TypeError("failed")));
  await assert.rejects(api.motions(), (error) => error instanceof RequestError && error.status === 0 && error.remedy !== "");
});

test("what is worn is listed, put on, taken off and rearranged under the session's address", async () => {
  const { api, asked } = answering(200, '[{"name":"tshirt","garment":"tshirt","fabric":"denim","edited":true}]');
  const worn = await api.worn("a b");
  assert.deepEqual(worn, [{ name: "tshirt", garment: "tshirt", fabric: "denim", edited: true }]);
  await api.putOn("a b", { garment: "skirt", fabric: null });
  await api.takeOff("a b", "skirt/2");
  await api.rearrange("a b", ["skirt", "tshirt"], null);
  const address = "http://example.test/try/api/sessions/a%20b/garments";
  assert.deepEqual(asked, [
    { url: address, method: "GET", body: undefined },
    { url: address, method: "POST", body: '{"garment":"skirt","fabric":null}' },
    { url: `${address}/skirt%2F2`, method: "DELETE", body: undefined },
    { url: address, method: "PUT", body: '{"order":["skirt","tshirt"],"edited":null}' },
  ]);
});

test("a change that takes longer is asked for again until it is done, and its progress is told", async () => {
  const job = { state: "running", detail: "Sewing", progress: null, location: "/api/sessions/s/jobs/j" };
  const replies = [
    new Response(JSON.stringify(job), { status: 202, headers: { "retry-after": "3" } }),
    new Response(JSON.stringify({ ...job, progress: 0.5 }), { status: 202 }),
    new Response('[{"name":"cape"}]', { status: 201 }),
    new Response("{}", { status: 202 }),
    new Response('{"message":"it was worn before it could be cancelled"}', { status: 409 }),
  ];
  const asked: string[] = [];
  const fetcher: typeof fetch = (input, init) => {
    const prefer = new Headers(init?.headers).get("prefer");
    asked.push(`${init?.method} ${new URL(new Request(input).url).pathname}${prefer ? ` (${prefer})` : ""}`);
    return Promise.resolve(replies.shift() ?? Response.error());
  };
  const waited: number[] = [];
  const api = new Api(new URL("http://example.test/try/"), fetcher, (seconds) => Promise.resolve(void waited.push(seconds)));
  const told: (number | null)[] = [];
  const worn = await api.putOn("s", { garment: "cape", fabric: null }, ({ progress }) => told.push(progress));
  assert.deepEqual(worn, [{ name: "cape" }]);
  assert.deepEqual(told, [null, 0.5]);
  assert.deepEqual(waited, [3, 1]);
  await api.cancel({ ...job, state: "running" });
  await assert.rejects(api.cancel({ ...job, state: "running" }), /before it could be cancelled/);
  const address = "/try/api/sessions/s/jobs/j";
  assert.deepEqual(asked, [
    "POST /try/api/sessions/s/garments (wait=1)",
    `GET ${address}`,
    `GET ${address}`,
    `DELETE ${address} (respond-async)`,
    `DELETE ${address} (respond-async)`,
  ]);
});
