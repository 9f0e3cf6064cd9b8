/** Figures as they are shown. */

/** Digits grouped by a thin space, a dash for what is not known. */
export function format(value: number, digits: number): string {
  if (!Number.isFinite(value)) return "–";
  const [whole, fraction] = value.toFixed(digits).split(".") as [string, string?];
  const grouped = whole.replace(/\B(?=(\d{3})+$)/g, "\u2009");
  return fraction === undefined ? grouped : `${grouped}.${fraction}`;
}

/** The figure with its unit behind it, if it is known and has one. */
export function withUnit(value: number, digits: number, unit: string): string {
  return `${format(value, digits)}${Number.isFinite(value) && unit ? ` ${unit}` : ""}`;
}

/** A motion's clock is at 0 in its first pose; before that, it is said how long the body still needs to get there. */
export function simulatedTime(seconds: number): string {
  const text = withUnit(Math.abs(seconds), 1, "s");
  return seconds <= -0.05 ? `starts in ${text}` : text;
}

/** The figure with so many significant digits, without zeros that say nothing: 0.25, 11, 1000. */
export function significant(value: number, digits: number): string {
  return String(Number(value.toPrecision(digits)));
}

/** A name made for programs as a person writes it: jumping_jack becomes Jumping jack. */
export function sentence(name: string): string {
  const words = name.replace(/[_-]+/g, " ").trim();
  return /^t ?shirt\b/i.test(words) ? words.replace(/^t ?shirt/i, "T-shirt") : words.charAt(0).toUpperCase() + words.slice(1);
}

/** With a capital at the start: what a program answers is shown as a sentence. */
export function capitalised(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}
