/** Client core: everything a viewer needs besides drawing. Framework-free. */
export { AccuracyDesk, type AccuracyChoice } from "./accuracy_desk.ts";
export { decadeAxis, evenAxis, type Axis } from "./axis.ts";
export { Client, steadyNow, type ClientEvents } from "./client.ts";
export { EffectDesk, type EffectRequest } from "./effect_desk.ts";
export { placesOf, wordsOf, type ChosenPlace, type Place, type PlaceKind } from "./effect_places.ts";
export { EffectSheet, type Entry, type SheetFault } from "./effect_sheet.ts";
export {
  canBeAdded,
  isOf,
  newRow,
  polarOf,
  Scale,
  vectorOf,
  type ChoiceField,
  type EffectField,
  type EffectParameters,
  type EffectWord,
  type NumberField,
  type Polar,
  type RowsField,
  type VectorField,
} from "./effect_words.ts";
export type { Link } from "./connection.ts";
export { accuracyAt, DIAL_END, positionOf } from "./dial.ts";
export { GarmentScene, type Shape } from "./garment_scene.ts";
export { readDesign, sewnTo, type Design, type Point, type Sewn } from "./pattern_design.ts";
export { PatternDesk, type DeskSurroundings } from "./pattern_desk.ts";
export type { PatternEdit } from "./pattern_edit.ts";
export { layOut, type Layout } from "./pattern_layout.ts";
export { lengthOf, middleOf, type Grip } from "./pattern_shape.ts";
export { PaceMeter, RateMeter } from "./meters.ts";
export { PriceLog, type Price } from "./price_log.ts";
export {
  Api,
  RequestError,
  type Body,
  type BodyReading,
  type Colour,
  type Fabric,
  type FabricLook,
  type Finish,
  type Garment,
  type Job,
  type MeshReading,
  type Motion,
  type MotionReading,
  type MotionUnits,
  type Print,
  type SessionInfo,
  type SessionWish,
  type Size,
  type Told,
  type WornItem,
} from "./rest.ts";
export { Wearer, type Tracking, type TrackedFrame } from "./wearer.ts";
export type { FrameFigures } from "./worker_messages.ts";
