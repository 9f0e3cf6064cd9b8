import type { Link } from "@tryon/core";
import type { StatusMessage } from "@tryon/protocol";

import { byId, setText } from "./dom.ts";

/**
 * What the lamp and the line beside it say: how the link stands, and then what the server is doing, in plain words. As
 * long as there is nothing to see, the same stands in the middle of the picture.
 */
export class StatusLine {
  private readonly line = byId("status");
  private readonly text = byId("status-text");
  private readonly waiting = byId("waiting");
  private readonly waitingText = byId("waiting-text");
  private readonly share = byId("waiting-share");
  private link: Link = { state: "connecting" };
  private status: StatusMessage | undefined;
  private busy: string | null = null;

  setLink(link: Link): void {
    this.link = link;
    this.line.title = link.state === "reconnecting" ? link.reason : "";
    if (link.state !== "open") this.status = undefined;
    this.show(describeLink(link));
  }

  setStatus(status: StatusMessage): void {
    this.status = status;
    this.show(describe(status, this.busy));
  }

  /** Something the page itself is doing, until the link or the server has something to say; null: it is done. */
  setBusy(sentence: string | null): void {
    this.busy = sentence;
    if (sentence !== null) this.show(sentence);
    else if (this.status) this.show(describe(this.status, null));
    else this.show(describeLink(this.link));
  }

  private show(sentence: string): void {
    const progress = this.status?.progress ?? null;
    const state = this.status?.state ?? "none";
    this.line.dataset.link = this.link.state;
    this.line.dataset.state = state;
    this.line.dataset.progress = progress === null ? "" : progress.toFixed(3);
    const ended = state === "failed" || this.link.state === "closed";
    this.waiting.dataset.share = ended ? "none" : progress === null ? "unknown" : "known";
    this.share.style.transform = progress === null ? "" : `scaleX(${progress})`;
    setText(this.text, sentence);
    setText(this.waitingText, sentence);
  }
}

function describeLink(link: Link): string {
  switch (link.state) {
    case "connecting":
      return "Connecting";
    case "reconnecting":
      return "Connection lost, reconnecting";
    case "closed":
      return `Session ended: ${link.reason}`;
    case "open":
      return "Connected";
  }
}

const LEAD: Record<StatusMessage["state"], string> = {
  preparing: "Getting ready",
  dressing: "Dressing",
  running: "Live",
  paused: "Paused",
  waiting: "Waiting for a tracked body",
  failed: "This garment can't be worn",
  closed: "Session ended",
};

/**
 * A status in words: what goes on, what exactly if the server says so, and how far it has come. What the page is `busy`
 * with leads where the server tells how far that is.
 */
function describe(status: StatusMessage, busy: string | null): string {
  const changing = typeof status.progress === "number"; // what is worn is to be worn otherwise
  const lead = (changing ? busy : null) ?? LEAD[status.state];
  const working = changing || status.state === "preparing" || status.state === "dressing" || status.state === "failed";
  const detail = working && status.detail ? `: ${status.detail}` : "";
  const share = working && typeof status.progress === "number" ? ` (${Math.round(status.progress * 100)} %)` : "";
  return `${lead}${detail}${share}`;
}
