// SPDX-License-Identifier: Apache-2.0
// build.mjs OUT: the page's template from page.html, page.css and src, in one file with its third-party code in it.
// toolchain/report_bundle calls it, with the packages of package-lock.json beside it.
import { readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const text = (name) => readFileSync(join(here, name), "utf8");
const licence = (name) => text(`node_modules/${name}/LICENSE`).trim();
const version = (name) => JSON.parse(text(`node_modules/${name}/package.json`)).version;

const packages = ["three", "uplot"];
const banner = `/* SPDX-License-Identifier: Apache-2.0 AND MIT
   PolygMap's report page. With code of ${packages.map((p) => `${p} ${version(p)}`).join(" and ")}, under these licences:

${packages.map((p) => `${p}:\n${licence(p)}`).join("\n\n")}
*/`;

async function bundled(entry) {
  const result = await build({
    entryPoints: [join(here, entry)],
    bundle: true,
    minify: true,
    write: false,
    format: "iife",
    target: ["chrome109", "firefox115", "safari16.4"],
    legalComments: "none",
    charset: "utf8",
    absWorkingDir: here,
    logLevel: "warning",
  });
  return result.outputFiles[0].text;
}

const js = banner + "\n" + (await bundled("src/entry.js"));
const css = await bundled("page.css");
const parts = { CSS: css, JS: js };
for (const [name, part] of Object.entries(parts)) {
  if (/<\/(script|style)|@POLYGMAP_|<!--/i.test(part))
    throw new Error(`the bundle's ${name} holds what would end it in a page`);
}
const page = text("page.html").replace(/@POLYGMAP_(CSS|JS)@/g, (_, name) => parts[name]);
writeFileSync(process.argv[2], page);
