// SPDX-License-Identifier: Apache-2.0
// Elements and texts. Whatever comes from the file goes in as text, never as markup.

/** h("div.name", {attributes}, children...): strings become text. */
export function h(selector, attributes, ...children) {
  const [tag, ...classes] = selector.split(".");
  return filled(document.createElement(tag), classes, attributes, children);
}

export function svg(selector, attributes, ...children) {
  const [tag, ...classes] = selector.split(".");
  return filled(document.createElementNS("http://www.w3.org/2000/svg", tag), classes, attributes, children);
}

function filled(element, classes, attributes, children) {
  if (classes.length) element.setAttribute("class", classes.join(" "));
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.flat().filter((c) => c !== null && c !== undefined && c !== false));
  return element;
}

export const isNumber = (v) => typeof v === "number" && Number.isFinite(v);

/** A number with so many digits behind the point, a real minus, and a dash where there is none. */
export function number(value, digits = 1, unit = "") {
  if (!isNumber(value)) return "–";
  const text = value
    .toFixed(digits)
    .replace(/^-(0(?:\.0*)?)$/, "$1")
    .replace("-", "−");
  return unit ? `${text} ${unit}` : text;
}

export const mm = (metres, digits = 1) => number(isNumber(metres) ? metres * 1e3 : null, digits, "mm");
export const seconds = (t_s) => number(t_s, 2, "s");

export function words(name) {
  return String(name ?? "").replace(/_/g, " ");
}

/** A button that takes the page to a moment. */
export function moment(player, t_s, text = seconds(t_s)) {
  if (!isNumber(t_s)) return h("span.faint", {}, text === seconds(t_s) ? "" : text);
  return h("button.moment", { type: "button", title: `Show ${seconds(t_s)}`, onclick: () => player.seek(t_s) }, text);
}

export function table(heads, rows, attributes = {}) {
  const head = h(
    "thead",
    {},
    h(
      "tr",
      {},
      heads.map((c) => (typeof c === "string" ? h("th", {}, c) : h("th", { class: c.class, title: c.title }, c.text))),
    ),
  );
  const body = h(
    "tbody",
    {},
    rows.map((row) =>
      row instanceof Node
        ? row
        : h(
            "tr",
            {},
            row.map((c, i) => cell(c, heads[i])),
          ),
    ),
  );
  return h(
    "div.scroll",
    { tabindex: "0", role: "region", "aria-label": attributes.label },
    h("table", { class: attributes.class }, head, body),
  );
}

export function cell(content, head) {
  const name = typeof head === "object" ? head?.class : null;
  return h("td", { class: name }, content ?? "–");
}
