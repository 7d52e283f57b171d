// SPDX-License-Identifier: Apache-2.0
// The rig as it is now: the one sentence, the picture, what is covered and the button.
import { element, replace } from "../../../common/page/dom";
import { Controls } from "./controls";
import { CoverageGrid } from "./coverage";
import type { State, Status } from "./model";
import { Preview } from "./preview";

const names: Record<State, string> = {
  idle: "ready",
  arming: "getting ready",
  pass: "recording",
  between_passes: "between passes",
  finishing: "finishing",
  waiting_for_host: "at the host",
  avatar_ready: "avatar ready",
  fault: "fault",
};

const room = (mib: number) => (mib < 1024 ? `${mib} MiB` : `${(mib / 1024).toFixed(1)} GiB`);

export class RigView {
  readonly root = element("div", { class: "rig" });
  private sentence = element("p", { class: "sentence", role: "alert" });
  private state = element("p", { class: "state" });
  private more = element("div", { class: "more" });
  private conditions = element("ul", { class: "conditions", "aria-label": "Also" });
  private facts = element("dl", { class: "facts" });
  private preview = new Preview();
  private grid = new CoverageGrid();
  private controls = new Controls();
  private signal = element("section", { class: "signal off", "aria-label": "What to do" }, this.state, this.sentence);

  constructor() {
    replace(
      this.root,
      element("h1", { class: "unseen" }, "The rig"),
      this.signal,
      this.preview.root,
      element("section", { class: "knowledge", "aria-label": "Progress" }, this.grid.root, this.more, this.conditions, this.facts),
      this.controls.root,
    );
  }

  update(status: Status): void {
    this.signal.className = `signal ${status.signal.colour} ${status.signal.pattern}`;
    this.signal.dataset.state = status.state;
    const { sentence } = status.signal;
    if (this.sentence.textContent !== sentence) this.sentence.textContent = sentence; // or it would be read out again
    this.sentence.classList.toggle("long", sentence.length > 48);
    const pass = status.state === "pass" || status.state === "arming" ? `${status.pass} pass: ` : "";
    this.state.textContent = pass + names[status.state];
    this.drawMore(status);
    const others = status.conditions.filter((one) => one.sentence !== status.signal.sentence);
    replace(
      this.conditions,
      ...others.map((one) => element("li", { class: `condition ${one.colour}`, "data-condition": one.name }, one.sentence)),
    );
    this.conditions.hidden = others.length === 0;
    this.grid.update(status);
    this.drawFacts(status);
    this.controls.update(status);
  }

  reach(connected: boolean): void {
    this.root.classList.toggle("unreachable", !connected);
    this.controls.reach(connected);
  }

  dispose(): void {
    this.preview.dispose();
    this.controls.dispose();
  }

  private drawMore(status: Status): void {
    const waits = status.host.stage !== "";
    replace(
      this.more,
      status.fault && element("p", { class: "fault" }, status.fault),
      status.notice && element("p", { class: "notice" }, status.notice),
      waits && element("p", {}, `The host: ${status.host.stage}`),
      waits && element("progress", { max: 1, value: status.host.fraction, "aria-label": "Progress at the host" }),
      status.state === "avatar_ready" && element("a", { class: "look", href: `#/scan/${status.scan}` }, "Look at the avatar"),
    );
  }

  private drawFacts(status: Status): void {
    const facts: [string, string][] = [
      ["Frames", `${status.frames} at ${status.frames_per_second.toFixed(0)} fps`],
      ["Kept", `${status.keyframes}${status.host.is_wanted ? `, ${status.acknowledged} sent` : ""}`],
      ["Disk", `${room(status.disk_free_mib)} free`],
      ["Host", !status.host.is_wanted ? "none" : status.host.text || (status.host.is_connected ? "connected" : "away")],
    ];
    replace(this.facts, ...facts.map(([name, value]) => element("div", {}, element("dt", {}, name), element("dd", {}, value))));
  }
}
