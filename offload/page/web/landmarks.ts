// SPDX-License-Identifier: Apache-2.0
// Picking landmarks in the keyframes: those that were not found, or found in the wrong place.
import { get, put } from "../../../common/page/api";
import { announce, element, replace } from "../../../common/page/dom";
import { type LandmarkFrame, type LandmarkView, framePath } from "./model";

// "leftEyeInner" -> "left eye inner"
const words = (name: string) => name.replace(/([A-Z])/g, " $1").toLowerCase();

class Picker {
  readonly root = element("div", { class: "picker" });
  private chosen = "";
  private frame?: LandmarkFrame;
  private picture = element("div", { class: "picture" });
  private list = element("select", { size: 8, "aria-label": "Landmark", onchange: () => this.choose(this.list.value) });
  private strip = element("div", { class: "strip", role: "group", "aria-label": "Keyframes" });
  private hint = element("p", { class: "hint", role: "status" });

  constructor(
    private scan: string,
    private view: LandmarkView,
  ) {
    const save = element("button", { type: "button", class: "primary", onclick: () => void this.save() }, "Save and run again");
    replace(
      this.root,
      element("div", { class: "picker-side" }, this.list, this.hint, save),
      element("div", { class: "picker-main" }, this.picture, this.strip),
    );
    this.fillList();
    this.fillStrip();
    this.choose(Object.keys(view.missing)[0] ?? view.names[0]);
    if (view.frames.length > 0) this.open(this.frontmost());
  }

  private frontmost(): LandmarkFrame {
    const turned = (frame: LandmarkFrame) => Math.abs(frame.azimuth_deg ?? 180) - (frame.name.startsWith("head") ? 20 : 0);
    return [...this.view.frames].sort((a, b) => turned(a) - turned(b))[0];
  }

  private picks(name: string): Record<string, [number, number]> {
    return this.view.picked[name]?.pixels ?? {};
  }

  private state(name: string): string {
    const count = Object.keys(this.picks(name)).length;
    if (count > 0) return `picked in ${count}`;
    if (this.view.placed[name]) return "found";
    return "missing";
  }

  private fillList(): void {
    const order = ["missing", "picked", "found"];
    const rank = (name: string) => order.findIndex((word) => this.state(name).startsWith(word));
    const names = [...this.view.names].sort((a, b) => rank(a) - rank(b));
    replace(
      this.list,
      ...names.map((name) => element("option", { value: name, selected: name === this.chosen }, `${words(name)} (${this.state(name)})`)),
    );
  }

  private fillStrip(): void {
    replace(
      this.strip,
      ...this.view.frames.map((frame) =>
        element(
          "button",
          { type: "button", "data-frame": frame.name, "aria-label": frame.name, onclick: () => this.open(frame) },
          element("img", { src: framePath(this.scan, frame.name, true), alt: "", loading: "lazy" }),
        ),
      ),
    );
  }

  private choose(name: string): void {
    this.chosen = name;
    this.list.value = name;
    const why = this.view.missing[name];
    this.hint.textContent =
      (why ? `${words(name)}: ${why.replace(/\.$/, "")}. ` : "") + "Tap the place in two pictures or more, taken from different sides. Tap a mark to take it back.";
    this.drawMarks();
  }

  private open(frame: LandmarkFrame): void {
    this.frame = frame;
    const image = element("img", { src: framePath(this.scan, frame.name, false), alt: `Keyframe ${frame.name}` });
    const canvas = element("div", { class: "marks" });
    canvas.addEventListener("click", (event) => this.pick(event, canvas));
    replace(this.picture, image, canvas);
    for (const button of this.strip.children) {
      button.toggleAttribute("data-open", (button as HTMLElement).dataset.frame === frame.name);
    }
    this.drawMarks();
  }

  private pick(event: MouseEvent, canvas: HTMLElement): void {
    if (!this.frame || !this.chosen || (event.target as HTMLElement).tagName === "BUTTON") return;
    const box = canvas.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * this.frame.width;
    const y = ((event.clientY - box.top) / box.height) * this.frame.height;
    const picked = (this.view.picked[this.chosen] ??= {});
    delete picked.position;
    (picked.pixels ??= {})[this.frame.name] = [Math.round(10 * x) / 10, Math.round(10 * y) / 10];
    this.drawMarks();
    this.fillList();
  }

  private unpick(name: string): void {
    const picked = this.view.picked[name];
    if (!picked?.pixels || !this.frame) return;
    delete picked.pixels[this.frame.name];
    if (Object.keys(picked.pixels).length === 0) delete this.view.picked[name];
    this.drawMarks();
    this.fillList();
  }

  private drawMarks(): void {
    const canvas = this.picture.querySelector(".marks");
    if (!canvas || !this.frame) return;
    const frame = this.frame;
    const at = (pixel: [number, number]) => {
      const place = document.createElement("span");
      place.style.left = `${(100 * pixel[0]) / frame.width}%`;
      place.style.top = `${(100 * pixel[1]) / frame.height}%`;
      return place;
    };
    const marks: HTMLElement[] = [];
    for (const [name, pixel] of Object.entries(frame.pixels)) {
      const mark = at(pixel);
      mark.className = `mark found${name === this.chosen ? " chosen" : ""}`;
      mark.title = words(name);
      marks.push(mark);
    }
    for (const name of Object.keys(this.view.picked)) {
      const pixel = this.picks(name)[frame.name];
      if (!pixel) continue;
      const mark = at(pixel);
      mark.className = `mark picked${name === this.chosen ? " chosen" : ""}`;
      mark.append(element("button", { type: "button", "aria-label": `Take back ${words(name)}`, onclick: () => this.unpick(name) }));
      marks.push(mark);
    }
    replace(canvas, ...marks);
  }

  private async save(): Promise<void> {
    try {
      await put(`/api/scans/${this.scan}/landmarks`, { version: 1, landmarks: this.view.picked });
      announce("The picked points are kept, and the scan is run again from its landmarks.");
    } catch (error) {
      announce((error as Error).message, "bad");
    }
  }
}

export async function landmarksPanel(scan: string): Promise<HTMLElement> {
  const view = await get<LandmarkView>(`/api/scans/${scan}/landmarks`);
  if (view.frames.length === 0) {
    return element("p", {}, "Landmarks can be picked once the cameras of the scan are known.");
  }
  return new Picker(scan, view).root;
}
