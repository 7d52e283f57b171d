// SPDX-License-Identifier: Apache-2.0
// Past scans, how far each is, and what came back of them.
import { element, replace } from "../../../common/page/dom";
import { type ScanRow, describe, progressOf, timeOf } from "./model";

function progressBar(scan: ScanRow): HTMLElement | null {
  const progress = progressOf(scan);
  return progress === null ? null : element("progress", { max: 1, value: progress, "aria-label": "Progress of the scan" });
}

function card(scan: ScanRow): HTMLElement {
  return element(
    "li",
    {},
    element(
      "a",
      { class: `card ${scan.phase === "delivered" ? "done" : scan.phase}`, href: `#/scan/${scan.id}`, "data-scan": scan.id },
      scan.cover
        ? element("img", { src: `/scans/${scan.id}/frames/${scan.cover}`, alt: "", loading: "lazy" })
        : element("span", { class: "no-cover", "aria-hidden": true }, "·"),
      element(
        "span",
        { class: "card-text" },
        element("strong", {}, timeOf(scan.id)),
        element("span", {}, `${scan.keyframes} pictures`),
        element("span", { class: "phase" }, describe(scan)),
        progressBar(scan),
      ),
    ),
  );
}

export function scanList(scans: ScanRow[]): HTMLElement {
  return element(
    "div",
    {},
    element("h1", {}, "Scans on this rig"),
    scans.length > 0
      ? element("ul", { class: "cards", id: "scans" }, ...scans.map(card))
      : element("p", { class: "empty" }, "No scans yet: press the button and walk around somebody."),
  );
}

export class ScanView {
  readonly root = element("div", { class: "scan" });
  private status = element("div", { class: "status" });
  private avatar = element("section", { class: "panel", "aria-label": "Avatar" });
  private files = element("section", { "aria-label": "Files" });
  private release: () => void = () => undefined;
  private shown = false; // the avatar
  private gone = false;

  constructor(scan: ScanRow) {
    replace(
      this.root,
      element("h1", {}, timeOf(scan.id)),
      this.status,
      this.avatar,
      this.files,
      element("p", {}, element("a", { href: "#/scans" }, "All scans")),
    );
    this.update(scan);
  }

  update(scan: ScanRow): void {
    replace(
      this.status,
      element("p", { class: `phase ${scan.phase === "delivered" ? "done" : scan.phase}`, role: "status" }, describe(scan)),
      progressBar(scan),
    );
    replace(
      this.files,
      element(
        "ul",
        { class: "files" },
        ...scan.results.map((file) =>
          element("li", {}, element("a", { href: `/scans/${scan.id}/${file}?download=1`, download: `${scan.id}-${file}` }, file)),
        ),
      ),
    );
    if (this.shown) return;
    if (scan.results.includes("avatar.glb")) {
      this.shown = true;
      void this.showAvatar(scan.id);
    } else {
      replace(this.avatar, element("p", {}, "The avatar appears here when it is back from the host."));
    }
  }

  dispose(): void {
    this.gone = true;
    this.release();
  }

  private async showAvatar(id: string): Promise<void> {
    replace(this.avatar, element("p", {}, "Loading the viewer …"));
    const { showAvatar } = await import("../../../common/page/viewer");
    if (!this.gone) this.release = showAvatar(this.avatar, `/scans/${id}/avatar.glb`);
  }
}
