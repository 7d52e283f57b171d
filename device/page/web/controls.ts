// SPDX-License-Identifier: Apache-2.0
// The one big button, as the rig's own: it does what is next. Beside it the way out.
import { post } from "../../../common/page/api";
import { announce, element, replace } from "../../../common/page/dom";
import type { State, Status } from "./model";

type Command = "start" | "stop" | "cancel" | "acknowledge";

interface Choice {
  label: string;
  command: Command | null; // nothing can be done now
}

function next(status: Status): Choice {
  switch (status.state) {
    case "idle":
      return { label: `Start ${status.pass || "a"} pass`, command: "start" };
    case "arming":
      return { label: "Getting ready … stop", command: "stop" };
    case "pass":
      return { label: "Stop pass", command: "stop" };
    case "between_passes":
      return { label: `Start ${status.pass || "next"} pass`, command: "start" };
    case "finishing":
      return { label: "Finishing …", command: null };
    case "waiting_for_host":
      return { label: "Start next scan", command: "start" };
    case "avatar_ready":
      return { label: "Next person", command: "acknowledge" };
    case "fault":
      return { label: "Try again", command: "acknowledge" };
  }
}

interface WayOut {
  label: string;
  question: string;
  explanation: string;
  yes: string;
}

const dropPass: WayOut = {
  label: "Cancel",
  question: "Throw this pass away?",
  explanation: "Its pictures are taken back. Passes that are finished stay.",
  yes: "Throw it away",
};
const waysOut: Partial<Record<State, WayOut>> = {
  arming: dropPass,
  pass: dropPass,
  between_passes: {
    label: "No more",
    question: "End the scan here?",
    explanation: "It goes to the host with the passes it has; there will be no other pass.",
    yes: "End it",
  },
  fault: {
    label: "Cancel",
    question: "End the scan here?",
    explanation: "What there is of it is closed and kept.",
    yes: "End it",
  },
};

export class Controls {
  readonly root = element("div", { class: "controls", role: "group", "aria-label": "Pass" });
  private height = element("input", {
    type: "number", id: "height", min: 300, max: 2600, step: 1, inputmode: "numeric", placeholder: "height mm",
    "aria-label": "Stature of the person in millimetres",
  });
  private main = element("button", { type: "button", class: "thumb", onclick: () => this.press() });
  private out = element("button", { type: "button", class: "danger way-out", onclick: () => this.ask() });
  private dialog: HTMLDialogElement | null = null;
  private status: Status | null = null;
  private reachable = true;
  private busy = false;

  constructor() {
    replace(this.root, this.height, this.out, this.main);
  }

  update(status: Status): void {
    if (this.status && status.state !== this.status.state) this.dialog?.close(); // its question is another one now
    this.status = status;
    this.draw();
  }

  reach(connected: boolean): void {
    this.reachable = connected;
    this.draw();
  }

  dispose(): void {
    this.dialog?.close();
  }

  private draw(): void {
    if (!this.status) return;
    const choice = next(this.status);
    const out = waysOut[this.status.state];
    if (this.main.textContent !== choice.label) this.main.textContent = choice.label;
    this.main.dataset.command = choice.command ?? "";
    this.main.disabled = !choice.command || !this.reachable || this.busy;
    this.main.classList.toggle("stop", choice.command === "stop");
    this.out.hidden = !out;
    if (out && this.out.textContent !== out.label) this.out.textContent = out.label;
    this.out.disabled = !this.reachable;
    this.height.hidden = this.status.state !== "idle";
  }

  private press(): void {
    const command = this.status && next(this.status).command;
    if (command) this.send(command);
  }

  private send(command: Command): void {
    const height = command === "start" && !this.height.hidden ? Number(this.height.value) : 0;
    this.busy = true; // a thumb presses twice
    this.draw();
    post("/api/commands", height > 0 ? { command, height_mm: height } : { command })
      .catch((error: Error) => announce(error.message, "bad"))
      .finally(() => {
        this.busy = false;
        this.draw();
      });
  }

  private ask(): void {
    const out = this.status && waysOut[this.status.state];
    if (!out) return;
    const dialog = element(
      "dialog",
      { "aria-labelledby": "way-out-title" },
      element("h2", { id: "way-out-title" }, out.question),
      element("p", {}, out.explanation),
      element(
        "div",
        { class: "choices" },
        element(
          "button",
          {
            type: "button",
            class: "danger",
            id: "confirm",
            onclick: () => {
              dialog.close();
              this.send("cancel");
            },
          },
          out.yes,
        ),
        element("button", { type: "button", class: "primary", autofocus: true, onclick: () => dialog.close() }, "Go on"),
      ),
    );
    dialog.addEventListener("close", () => {
      dialog.remove();
      this.dialog = null;
    });
    this.dialog = dialog;
    document.body.append(dialog);
    dialog.showModal();
  }
}
