// SPDX-License-Identifier: Apache-2.0
// The page of the rig: follows the address and the rig's news.
import { listen } from "../../../common/page/api";
import { element, replace } from "../../../common/page/dom";
import type { ScanRow, Status } from "./model";
import { RigView } from "./rig_view";
import { ScanView, scanList } from "./scans";

const view = document.getElementById("view")!;
const connection = document.getElementById("connection")!;
let status: Status | null = null;
let scans: ScanRow[] | null = null;
let connected = true;
let rig: RigView | null = null;
let scan: { id: string; view: ScanView } | null = null;

function leave(): void {
  rig?.dispose();
  scan?.view.dispose();
  rig = null;
  scan = null;
}

function drawScans(): void {
  if (!scans) return;
  const id = /^#\/scan\/([0-9A-Z]{26})$/.exec(location.hash)?.[1];
  if (location.hash === "#/scans") return replace(view, scanList(scans));
  if (!id) return;
  const row = scans.find((one) => one.id === id);
  if (!row) {
    leave();
    return replace(view, element("h1", {}, "No such scan"), element("a", { href: "#/scans" }, "All scans"));
  }
  if (scan?.id === id) return scan.view.update(row);
  scan = { id, view: new ScanView(row) };
  replace(view, scan.view.root);
}

function route(): void {
  leave();
  const isRig = !location.hash.startsWith("#/scan");
  document.body.classList.toggle("on-rig", isRig);
  document.getElementById("to-rig")!.toggleAttribute("aria-current", isRig);
  document.getElementById("to-scans")!.toggleAttribute("aria-current", !isRig);
  if (!isRig) return drawScans();
  rig = new RigView();
  replace(view, rig.root);
  if (status) rig.update(status);
  rig.reach(connected);
}

// A browser does not try again when it is refused, as after the token has changed: only the answer to the page itself
// says how to get in.
async function onLost(source: EventSource): Promise<void> {
  if (source.readyState !== EventSource.CLOSED) return;
  const answer = await fetch("/api/status").catch(() => null);
  if (answer?.status === 401) location.reload();
  else setTimeout(follow, 2000);
}

function follow(): void {
  const source = listen(
    "/api/events",
    {
      status: (now: Status) => {
        status = now;
        rig?.update(now);
      },
      scans: (rows: ScanRow[]) => {
        scans = rows;
        drawScans();
      },
    },
    (isThere) => {
      connected = isThere;
      connection.textContent = isThere ? "" : "No connection to the rig; trying again …";
      rig?.reach(isThere);
      if (!isThere) void onLost(source);
    },
  );
}

addEventListener("hashchange", route);
route();
follow();
