// SPDX-License-Identifier: Apache-2.0
// One scan: its avatar, report, files, stages and landmarks.
import { get, post, remove } from "../../../common/page/api";
import { announce, element, replace } from "../../../common/page/dom";
import { landmarksPanel } from "./landmarks";
import { type ScanRow, type ScanView, describe, when } from "./model";
import { progressBar } from "./scan_list";
import { stagesPanel } from "./stages";

const tabs = ["Avatar", "Report", "Files", "Stages", "Landmarks"] as const;
type Tab = (typeof tabs)[number];

export class ScanPage {
  readonly root = element("div", { class: "scan" });
  private status = element("div", { class: "status" });
  private panel = element("section", { class: "panel", id: "panel", role: "tabpanel", "aria-label": "Avatar" });
  private bar = element("div", { class: "tabs", role: "tablist" });
  private tab: Tab = "Avatar";
  private release: () => void = () => undefined;
  private shown = 0; // the latest call of show

  constructor(private scan: ScanView) {
    replace(
      this.root,
      element("h1", {}, scan.device || "Scan"),
      element("p", { class: "when" }, when(scan.created), scan.height_mm ? ` · ${Math.round(scan.height_mm)} mm` : ""),
      this.status,
      this.bar,
      this.panel,
    );
    this.drawStatus();
    this.drawBar();
    void this.show();
  }

  get id(): string {
    return this.scan.id;
  }

  // News of this scan.
  update(row: ScanRow): void {
    const settled = row.phase !== this.scan.phase;
    this.scan = { ...this.scan, ...row };
    this.drawStatus();
    if (settled) void this.reload();
  }

  dispose(): void {
    ++this.shown;
    this.release();
  }

  private async reload(): Promise<void> {
    try {
      this.scan = await get<ScanView>(`/api/scans/${this.scan.id}`);
    } catch {
      return; // it has been deleted: the list says so
    }
    this.drawStatus();
    if (this.tab !== "Landmarks") await this.show();
  }

  private drawStatus(): void {
    const { scan } = this;
    const working = scan.phase === "running" || scan.phase === "queued";
    replace(
      this.status,
      element("p", { class: `phase ${scan.phase}`, "data-phase": scan.phase, role: "status" }, describe(scan)),
      progressBar(scan),
      element(
        "div",
        { class: "row" },
        working &&
          element("button", { type: "button", onclick: () => this.act(post(`/api/scans/${scan.id}/cancel`), "Cancelled.") }, "Cancel"),
        scan.phase === "failed" &&
          element("button", { type: "button", onclick: () => this.act(post(`/api/scans/${scan.id}/rerun`, { options: {} }), "Trying again.") }, "Try again"),
        element("button", { type: "button", class: "danger", onclick: () => this.confirmDelete() }, "Delete"),
      ),
    );
  }

  private act(work: Promise<unknown>, good: string): void {
    work.then(() => announce(good)).catch((error: Error) => announce(error.message, "bad"));
  }

  private confirmDelete(): void {
    const dialog = element(
      "dialog",
      { "aria-labelledby": "delete-title" },
      element("h2", { id: "delete-title" }, "Delete this scan?"),
      element("p", {}, "Its pictures, its avatar and everything made of them are removed for good, here on the host."),
      element(
        "div",
        { class: "row" },
        element("button", { type: "button", onclick: () => dialog.close() }, "Keep"),
        element(
          "button",
          {
            type: "button",
            class: "danger",
            onclick: () => {
              dialog.close();
              remove(`/api/scans/${this.scan.id}`)
                .then(() => {
                  announce("The scan is deleted.");
                  location.hash = "#/";
                })
                .catch((error: Error) => announce(error.message, "bad"));
            },
          },
          "Delete",
        ),
      ),
    );
    dialog.addEventListener("close", () => dialog.remove());
    document.body.append(dialog);
    dialog.showModal();
  }

  private drawBar(): void {
    replace(
      this.bar,
      ...tabs.map((tab) =>
        element(
          "button",
          {
            type: "button",
            role: "tab",
            id: `tab-${tab}`,
            "aria-controls": "panel",
            "aria-selected": String(tab === this.tab),
            onclick: () => {
              this.tab = tab;
              this.panel.setAttribute("aria-label", tab);
              this.drawBar();
              document.getElementById(`tab-${tab}`)?.focus();
              void this.show();
            },
          },
          tab,
        ),
      ),
    );
  }

  private async show(): Promise<void> {
    const turn = ++this.shown;
    this.release();
    this.release = () => undefined;
    const { scan } = this;
    const has = (file: string) => scan.files.includes(file);
    if (this.tab === "Avatar") {
      if (!has("avatar.glb")) return replace(this.panel, element("p", {}, "The avatar appears here when it is ready."));
      replace(this.panel, element("p", {}, "Loading the viewer …"));
      const { showAvatar } = await import("../../../common/page/viewer");
      if (turn !== this.shown) return;
      const sources = scan.texture_sources ? `/scans/${scan.id}/texture/source.png` : undefined;
      this.release = showAvatar(this.panel, `/scans/${scan.id}/avatar.glb`, sources);
    } else if (this.tab === "Report") {
      if (!has("report.html")) return replace(this.panel, element("p", {}, "The report appears here when it is ready."));
      replace(
        this.panel,
        element("iframe", { title: "Report", src: `/scans/${scan.id}/report.html`, sandbox: "allow-scripts", class: "report" }),
      );
    } else if (this.tab === "Files") {
      replace(
        this.panel,
        scan.files.length === 0 && element("p", {}, "Nothing to download yet."),
        element(
          "ul",
          { class: "files" },
          ...scan.files.map((file) =>
            element("li", {}, element("a", { href: `/scans/${scan.id}/${file}?download=1`, download: `${scan.id}-${file}` }, file)),
          ),
        ),
        ...scan.warnings.map((warning) => element("p", { class: "warning" }, warning)),
      );
    } else if (this.tab === "Stages") {
      replace(this.panel, stagesPanel(scan));
    } else {
      const panel = await landmarksPanel(scan.id).catch((error: Error) => element("p", {}, error.message));
      if (turn === this.shown) replace(this.panel, panel);
    }
  }
}
