// SPDX-License-Identifier: Apache-2.0
// The first view: all scans with their progress, and the way to add a recording.
import { element } from "../../../common/page/dom";
import { type ScanRow, describe, framePath, when } from "./model";
import { uploadForm } from "./upload";

export function progressBar(scan: ScanRow): HTMLElement | null {
  if (scan.phase !== "running" && scan.phase !== "importing") return null;
  return element("progress", { max: 1, value: scan.fraction, "aria-label": `Progress of ${scan.stage || "the scan"}` });
}

function card(scan: ScanRow): HTMLElement {
  return element(
    "li",
    {},
    element(
      "a",
      { class: `card ${scan.phase}`, href: `#/scan/${scan.id}`, "data-scan": scan.id, "data-phase": scan.phase },
      scan.cover
        ? element("img", { src: framePath(scan.id, scan.cover, true), alt: "", loading: "lazy" })
        : element("span", { class: "no-cover", "aria-hidden": true }, "·"),
      element(
        "span",
        { class: "card-text" },
        element("strong", {}, scan.device || "a device"),
        element("span", {}, when(scan.created)),
        element("span", { class: "phase" }, describe(scan)),
        progressBar(scan),
      ),
    ),
  );
}

export function scanList(scans: ScanRow[]): HTMLElement {
  const newest = [...scans].sort((a, b) => (a.id < b.id ? 1 : -1));
  return element(
    "div",
    {},
    element("h1", {}, "Scans"),
    newest.length > 0
      ? element("ul", { class: "cards", id: "scans" }, ...newest.map(card))
      : element(
          "p",
          { class: "empty" },
          "No scans yet. Pair a device with `gyre-offload pair` and walk around somebody, or add a recording.",
        ),
    uploadForm(),
  );
}
