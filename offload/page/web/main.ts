// SPDX-License-Identifier: Apache-2.0
// The page of gyre-offload: follows the address and the host's news.
import { get, listen } from "../../../common/page/api";
import { element, replace } from "../../../common/page/dom";
import type { ScanRow, ScanView } from "./model";
import { scanList } from "./scan_list";
import { ScanPage } from "./scan_page";

const view = document.getElementById("view")!;
const scans = new Map<string, ScanRow>();
let page: ScanPage | null = null;
let listShown = false;

function drawList(): void {
  // A form that somebody is filling in stays as it is.
  const list = document.getElementById("scans");
  const open = document.querySelector<HTMLDetailsElement>("details.upload")?.open ?? false;
  const fresh = scanList([...scans.values()]);
  if (listShown && open) {
    const cards = fresh.querySelector("#scans");
    if (list && cards) list.replaceWith(cards);
    else if (cards) document.querySelector(".empty")?.replaceWith(cards);
    return;
  }
  replace(view, fresh);
  listShown = true;
}

async function route(): Promise<void> {
  page?.dispose();
  page = null;
  listShown = false;
  const match = /^#\/scan\/([0-9A-Z]{26})$/.exec(location.hash);
  if (!match) return drawList();
  try {
    const scan = await get<ScanView>(`/api/scans/${match[1]}`);
    page = new ScanPage(scan);
    replace(view, page.root);
    view.focus({ preventScroll: true });
  } catch (error) {
    replace(view, element("h1", {}, "No such scan"), element("p", {}, (error as Error).message), element("a", { href: "#/" }, "All scans"));
  }
}

listen(
  "/api/events",
  {
    scans: (rows: ScanRow[]) => {
      scans.clear();
      for (const row of rows) scans.set(row.id, row);
      const current = page && scans.get(page.id);
      if (page && current) page.update(current);
      else if (!page && !location.hash.startsWith("#/scan/")) drawList();
    },
    scan: (row: ScanRow) => {
      scans.set(row.id, row);
      if (page?.id === row.id) page.update(row);
      else if (listShown) drawList();
    },
    deleted: ({ id }: { id: string }) => {
      scans.delete(id);
      if (page?.id === id) location.hash = "#/";
      else if (listShown) drawList();
    },
  },
  (connected) => {
    document.getElementById("connection")!.textContent = connected ? "" : "no connection to the host; trying again …";
  },
);
addEventListener("hashchange", () => void route());
void route();
