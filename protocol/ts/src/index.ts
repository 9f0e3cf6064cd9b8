export * from "./codec.ts";
export * from "./control.ts";
export * from "./errors.ts";
export * from "./generated.ts";
export type { Inflate } from "./inflate.ts";
export { Skinner } from "./skinning.ts";
export * from "./topology.ts";
