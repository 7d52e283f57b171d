// SPDX-License-Identifier: Apache-2.0
// What the camera sees now. The next picture is asked for when one has come, and the rig answers with the latest: a
// slow line makes pictures rare and not late.
import { element } from "../../../common/page/dom";

const stillAfter = 1500; // ms without a picture, then the one shown is not what the camera sees
const interval = 80; // ms from one question to the next: the rig has other things to do than to compress pictures

export class Preview {
  readonly root: HTMLElement;
  private image = element("img", { alt: "What the camera sees", hidden: true });
  private note = element("p", { class: "no-picture" }, "No picture from the camera");
  private stopped = new AbortController();
  private shownAt = 0;
  private watch: number;

  constructor() {
    this.root = element("div", { class: "preview" }, this.image, this.note);
    this.watch = window.setInterval(() => this.judge(), 500);
    void this.follow();
  }

  dispose(): void {
    this.stopped.abort();
    clearInterval(this.watch);
    URL.revokeObjectURL(this.image.src);
  }

  private judge(): void {
    const still = performance.now() - this.shownAt > stillAfter;
    this.image.classList.toggle("still", still);
    this.note.hidden = !still;
  }

  private async follow(): Promise<void> {
    let seen = "0";
    while (!this.stopped.signal.aborted) {
      if (document.hidden) {
        await new Promise((resolve) => document.addEventListener("visibilitychange", resolve, { once: true }));
        continue;
      }
      const next = performance.now() + interval;
      try {
        const response = await fetch(`/api/preview.jpg?after=${seen}`, { signal: this.stopped.signal });
        if (response.status === 200) {
          seen = response.headers.get("X-Gyre-Number") ?? "0";
          await this.show(await response.blob(), seen);
          await this.pause(next - performance.now());
        } else if (!response.ok) {
          await this.pause(1000);
        }
      } catch {
        if (!this.stopped.signal.aborted) await this.pause(1000);
      }
    }
  }

  private pause = (ms: number) => new Promise((resolve) => setTimeout(resolve, Math.max(0, ms)));

  private async show(picture: Blob, number: string): Promise<void> {
    const before = this.image.src;
    this.image.src = URL.createObjectURL(picture);
    await this.image.decode();
    if (before) URL.revokeObjectURL(before);
    this.image.hidden = false;
    this.image.dataset.number = number;
    this.shownAt = performance.now();
    this.judge();
  }
}
