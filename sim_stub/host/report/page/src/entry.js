// SPDX-License-Identifier: Apache-2.0
// Which page it is: that of a depth picture, of a log, or the report of a climb. The data's first key says so.
import { h } from "./core/dom.js";
import { framePage } from "./frame/frame_page.js";
import { logPage } from "./log/log_page.js";
import { climbPage } from "./main.js";

const pages = { "polygmap-frame": framePage, "polygmap-log": logPage };
const text = document.getElementById("polygmap-data").textContent;
const format = /^\s*\{\s*"format"\s*:\s*"([^"]*)"/.exec(text)?.[1];

/** Both pages of data that were thinned before: read, shown, or one sentence. */
async function show(make) {
  const root = document.getElementById("page");
  try {
    const data = JSON.parse(text);
    if (data.version !== 1)
      throw new Error(`the page's data have version ${data.version}, and this page reads version 1`);
    document.title = `${data.name} · PolygMap`;
    window.polygmap = await make(root, data);
  } catch (error) {
    const said = h("p.reason", {}, `This page cannot be read: ${error.message}.`);
    return root.replaceChildren(h("header", {}, h("div.title", {}, h("h1", {}, "PolygMap"), said)));
  }
  document.documentElement.dataset.ready = "yes";
}

if (pages[format]) show(pages[format]);
else climbPage();
