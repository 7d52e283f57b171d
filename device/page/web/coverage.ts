// SPDX-License-Identifier: Apache-2.0
// What is covered: a grid with a row a band and a column a sector, from where the pass began.
import { element, replace } from "../../../common/page/dom";
import type { BandCoverage, Status } from "./model";

const words: Record<string, string> = { ".": "not seen", "~": "not sharp", "#": "covered" };
const kinds: Record<string, string> = { ".": "missing", "~": "unsharp", "#": "covered" };

function row(band: BandCoverage, here: number | null): HTMLElement {
  const covered = [...band.cells].filter((cell) => cell === "#").length;
  const cells = [...band.cells].map((cell, sector) => {
    const quality = Math.max(1, Number(band.quality[sector]));
    return element("td", {
      class: `${kinds[cell]}${cell === "#" ? ` quality-${Math.ceil(quality / 3)}` : ""}${sector === here ? " here" : ""}`,
      title: words[cell],
    });
  });
  return element(
    "tr",
    { "aria-label": `${band.band}: ${covered} of ${band.cells.length} sectors covered` },
    element("th", { scope: "row" }, band.band, element("small", {}, band.is_ring ? ` ${covered}/${band.cells.length}` : " from anywhere")),
    ...cells,
  );
}

export class CoverageGrid {
  readonly root = element("table", { class: "coverage" });
  private shown = "";

  update(status: Status): void {
    const key = JSON.stringify([status.coverage, status.sector, status.band]);
    if (key === this.shown) return;
    this.shown = key;
    this.root.hidden = status.coverage.length === 0;
    const sectors = status.coverage[0]?.cells.length ?? 0;
    const quarter = sectors / 4;
    replace(
      this.root,
      element("caption", {}, "Covered, by degrees from the start"),
      element(
        "thead",
        {},
        element(
          "tr",
          {},
          element("td", {}),
          ...[0, 1, 2, 3].map((i) => element("th", { scope: "colgroup", colspan: quarter }, `${90 * i}°`)),
        ),
      ),
      element(
        "tbody",
        {},
        ...status.coverage.map((band) => row(band, band.band === status.band ? status.sector : null)),
      ),
    );
  }
}
