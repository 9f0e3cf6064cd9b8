import { Api, RateMeter, RequestError, steadyNow, type Fabric, type Print, type WornItem } from "@tryon/core";

import { AccuracyPanel } from "./accuracy.ts";
import { AdviceLine } from "./advice.ts";
import { Ar } from "./ar.ts";
import { Choices } from "./choices.ts";
import { byId, setText } from "./dom.ts";
import { EffectsPanel } from "./effects.ts";
import { cssColour } from "./fabrics.ts";
import { Figure } from "./figure.ts";
import { FitCard } from "./fit.ts";
import { Fitting, type FittingView } from "./fitting.ts";
import { FabricMaterial } from "./materials.ts";
import { NoticeBoard, type Notice } from "./notice.ts";
import { PatternPanel } from "./pattern.ts";
import { PrintPanel } from "./prints.ts";
import { Readout, type Figures } from "./readout.ts";
import { Stage } from "./stage.ts";
import { StatusLine } from "./status.ts";
import { Upload } from "./upload.ts";
import { Wardrobe } from "./wardrobe.ts";

/** file name of the bundled worker, filled in by the build */
declare const WORKER_FILE: string;

declare global {
  interface Window {
    /** the readout's figures, for tests and the curious */
    tryon: { readonly readout: Figures };
  }
}

const REFRESH_MS = 250;
const NOT_POSED: Notice = {
  title: "AR needs a body that can be posed",
  message: "This body is an animated mesh: it moves by itself and can't follow you.",
  remedy: "Choose the default body, then enter AR.",
};

/** The page's parts, and how they are connected. */
class Studio implements FittingView {
  private readonly stage = new Stage(byId("stage", HTMLCanvasElement));
  private readonly api = new Api(new URL(".", location.href));
  private readonly figure: Figure;
  private readonly readout = new Readout();
  private readonly advice = new AdviceLine();
  private readonly fit = new FitCard((size) => void this.fitting.wearSize(size));
  private readonly statusLine = new StatusLine();
  private readonly board = new NoticeBoard();
  private readonly pattern = new PatternPanel(
    (message) => this.fitting.client?.send(message),
    (notice) => this.board.show(notice),
    () => (typeof this.editedItem?.size === "number" ? this.editedItem.size : this.wornSize),
    () => this.effectsPanel.patternChanged(),
  );
  private readonly accuracy = new AccuracyPanel((message) => this.fitting.client?.send(message));
  private readonly effectsPanel: EffectsPanel = new EffectsPanel(
    (message) => this.fitting.client?.send(message),
    this.pattern,
    (notice) => this.board.show(notice),
  );
  private readonly drawn = new RateMeter();
  private readonly fitting: Fitting;
  private readonly panel: Choices;
  private readonly ar: Ar;
  private subject: string | undefined;
  private fabric: Fabric | undefined;
  private known: readonly Fabric[] = [];
  /** name of the garment that is edited */
  private editing = "";
  private dressed = -1;
  /** of what is worn, over its pattern's own */
  private wornSize = 1;
  /** the one of several garments that is edited */
  private editedItem: WornItem | undefined;
  private readonly wardrobe: Wardrobe;
  private colour: string | undefined;
  private print: Print | undefined;
  private readonly prints: PrintPanel;
  private readonly play = byId("play", HTMLButtonElement);
  private readonly view = byId("view");

  constructor() {
    const { api } = this;
    this.figure = new Figure(() => new FabricMaterial((path) => api.fileUrl(path), () => this.stage.invalidate()));
    this.stage.scene.add(this.figure.object);
    this.fitting = new Fitting(api, new URL(WORKER_FILE, import.meta.url), this);
    this.wardrobe = new Wardrobe(api, {
      session: () => this.fitting.sessionId,
      notice: (notice) => this.board.show(notice),
      busy: (sentence) => this.statusLine.setBusy(sentence),
      edits: (garment) => {
        this.editedItem = garment;
        this.effectsPanel.look(garment?.name ?? "");
      },
    });
    this.panel = new Choices({
      garment: (id) => void this.fitting.wear(id),
      size: (size) => void this.fitting.wearSize(size),
      body: (id) => void this.fitting.standAs(id),
      motion: (name) => void this.fitting.move(name),
      fabric: (name) => this.fitting.sewFrom(name),
      colour: (colour) => {
        this.colour = colour;
        this.finish();
      },
      preset: (name) => void this.fitting.detail(name),
      remove: (kind, id, called) => {
        if (confirm(`Remove ${called} from the server? Nobody can choose it any more.`)) void this.fitting.remove(kind, id, called);
      },
    });
    this.ar = new Ar(this.stage, this.figure, {
      client: () => this.fitting.client,
      subject: () => this.subject,
      followable: () => {
        if (this.fitting.movesByItself) this.board.show(NOT_POSED);
        return !this.fitting.movesByItself;
      },
      follow: (wearer) => this.fitting.followWearer(wearer),
      drawn: () => this.noteDrawn(steadyNow()),
      failed: (why) => this.board.show({ title: "AR could not be entered", message: why }),
    });
    this.prints = new PrintPanel(
      api,
      (print) => {
        this.print = print;
        this.finish();
      },
      (notice) => this.board.show(notice),
    );
    const save = byId("save-glb", HTMLAnchorElement);
    save.addEventListener("click", () => {
      save.href = api.glbUrl(this.session);
    });
    save.href = "#"; // a link only with an address: it is that of the click
    new Upload({
      garment: (file, reading) => this.fitting.add(file, reading),
      motion: (file, reading) => this.fitting.addMotion(file, reading),
      body: (file, reading) => this.fitting.addBody(file, reading),
      picture: (file) => {
        if (!this.prints.takes(file)) return false;
        void this.prints.add(file);
        return true;
      },
    });
    this.play.addEventListener("click", () => this.fitting.togglePlay());
    byId("reset-view").addEventListener("click", () => this.stage.resetView());
    const follow = byId("follow", HTMLButtonElement);
    follow.addEventListener("click", () => {
      this.stage.follow = !this.stage.follow;
      follow.ariaPressed = String(this.stage.follow);
    });
    window.tryon = { readout: this.readout.figures };
    window.setInterval(() => this.readout.refresh(this.fitting.client), REFRESH_MS);
    requestAnimationFrame(this.draw);
  }

  start(): Promise<void> {
    return this.fitting.start(new URLSearchParams(location.search).get("session"));
  }

  private readonly draw = (): void => {
    const { client } = this.fitting;
    if (client && !this.stage.presenting) {
      client.scene.take();
      if (this.figure.update(client.scene)) {
        this.stage.invalidate();
        this.dressAnew(client.scene.topologyVersion);
        this.view.dataset.shown = this.figure.shown ? "figure" : "nothing";
      }
      const frame = client.scene.figures;
      if (frame) {
        this.stage.moveOrigin(frame.anchor);
        this.stage.moveWearer(frame.root[0] - frame.anchor[0], frame.root[2] - frame.anchor[2]);
      }
    }
    const now = steadyNow();
    if (this.stage.draw(now)) this.noteDrawn(now);
    requestAnimationFrame(this.draw);
  };

  /** Another topology may be of other garments, in other fabrics. */
  private dressAnew(topology: number): void {
    if (topology === this.dressed) return;
    this.dressed = topology;
    this.dress();
    void this.wardrobe.refresh();
  }

  private noteDrawn(now: number): void {
    const { client } = this.fitting;
    if (!client) return;
    this.drawn.tick(now);
    this.readout.drawn(client, this.drawn.rate(now));
  }

  private dress(): void {
    const chosen = this.fabric;
    if (!chosen) return;
    const print = this.print && { url: this.api.fileUrl(this.print.image), size: this.print.size };
    const { garments } = this.fitting.client?.scene ?? { garments: [] };
    const several = garments.length > 1;
    this.figure.fabrics.forEach((material, k) => {
      const garment = several ? garments.at(k) : undefined;
      const { look } = this.known.find(({ name }) => name === garment?.fabric) ?? chosen;
      if (garment && garment.name !== this.editing) material.wear({ look, dye: undefined, print: undefined });
      else material.wear({ look, dye: this.colour, print });
    });
    byId("colours").style.setProperty("--own", cssColour(chosen.look.colour));
  }

  /** Of the session that is shown; "": none yet. */
  private get session(): string {
    return new URLSearchParams(location.search).get("session") ?? "";
  }

  /** Shows what was chosen for the fabric's looks, and tells the session, for others and for files. */
  private finish(): void {
    this.dress();
    const dye = this.print ? null : (this.colour ?? null); // a print takes its place
    if (this.session) this.api.chooseFinish(this.session, { dye, print: this.print?.id ?? null }).catch(unanswered);
  }

  /** Shows what others chose for the session that was joined. */
  private async joinFinish(): Promise<void> {
    const session = this.session;
    const { dye, print } = await this.api.finish(session);
    const worn = await this.prints.join(print);
    if (session !== this.session) return; // another one is shown by now
    this.colour = dye ?? undefined;
    this.print = worn;
    this.panel.dyedIn(dye);
    this.dress();
  }

  // FittingView ----------------------------------------------------------------------------------------------------

  busy(sentence: string | null): void {
    this.statusLine.setBusy(sentence);
  }

  link(...[link]: Parameters<FittingView["link"]>): void {
    this.statusLine.setLink(link);
    if (link.state !== "open") {
      this.pattern.forget();
      this.effectsPanel.lost();
      this.effectsPanel.beingDressed(false);
    }
    this.play.disabled = link.state === "connecting" || link.state === "reconnecting";
    if (link.state === "closed") this.showPlaying(false, "Start again");
  }

  welcomed(...[welcome]: Parameters<FittingView["welcomed"]>): void {
    this.subject = welcome.subjects[0];
    this.pattern.forget(); // it is told anew
    this.ar.welcomed();
    this.accuracy.welcomed();
  }

  status(...[status]: Parameters<FittingView["status"]>): void {
    this.statusLine.setStatus(status);
    this.fit.show(status);
    this.accuracy.take(status);
    this.pattern.status(status.changes ?? []);
    this.effectsPanel.beingDressed(status.state === "preparing" || status.state === "dressing");
    this.wornSize = status.worn_size ?? 1;
    this.panel.wornIn(status.worn_size ?? null, status.state === "failed");
    this.view.dataset.state = status.state;
    if (status.state === "preparing" || status.state === "dressing") this.advice.hide(); // it was of what is taken off
    this.showPlaying(status.playing, status.playing ? "Pause" : "Play");
  }

  report(...[report]: Parameters<FittingView["report"]>): void {
    this.readout.setReport(report);
    this.accuracy.report(report);
    this.advice.show(report.advice ?? "");
  }

  effects(...[effects]: Parameters<FittingView["effects"]>): void {
    this.effectsPanel.take(effects);
  }

  effectRefused(...[error]: Parameters<FittingView["effectRefused"]>): boolean {
    return this.effectsPanel.refused(error);
  }

  outfit(...[outfit]: Parameters<FittingView["outfit"]>): void {
    this.wardrobe.told(outfit.worn);
  }

  design(...[design]: Parameters<FittingView["design"]>): void {
    this.pattern.design(design);
    if (design.garment === undefined || design.garment === this.editing) return;
    this.editing = design.garment;
    this.dress();
    void this.wardrobe.refresh();
  }

  edited(...[edited]: Parameters<FittingView["edited"]>): void {
    this.pattern.edited(edited);
  }

  editRefused(...[error]: Parameters<FittingView["editRefused"]>): boolean {
    return this.pattern.refused(error);
  }

  notice(...[notice]: Parameters<FittingView["notice"]>): void {
    this.board.show(notice);
  }

  choices(...[catalogue, wish]: Parameters<FittingView["choices"]>): void {
    this.panel.show(catalogue, wish);
    this.effectsPanel.offer(catalogue.effects);
    this.known = catalogue.fabrics;
    this.wardrobe.offer(catalogue.garments);
    const fabric = catalogue.fabrics.find(({ name }) => name === wish.fabric) ?? catalogue.fabrics.at(0);
    if (fabric === this.fabric) return;
    this.fabric = fabric;
    this.dress();
  }

  began(...[, how]: Parameters<FittingView["began"]>): void {
    const joined = how === "joined";
    this.pattern.forget();
    if (how !== "continued") this.effectsPanel.forget();
    this.dressed = -1;
    this.readout.reset();
    this.accuracy.began(joined);
    if (joined) this.joinFinish().catch(unanswered);
    else this.finish();
    this.advice.hide();
    this.board.hideFault();
  }

  private showPlaying(playing: boolean, text: string): void {
    this.play.ariaPressed = String(playing);
    setText(byId("play-text"), text);
  }
}

/** Of looks, which are there without the server's answer, too: that it does not answer is told where it matters. */
function unanswered(error: unknown): void {
  if (!(error instanceof RequestError)) throw error;
}

try {
  void new Studio().start();
} catch (error) {
  const why = error instanceof Error ? error.message : String(error);
  new NoticeBoard().show({
    title: "The picture can't be drawn",
    message: why,
    remedy: "Use a browser with WebGL 2, and see that hardware acceleration is on.",
  });
}
