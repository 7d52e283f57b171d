// SPDX-License-Identifier: Apache-2.0
// The stages of a scan, and running them again with other options.
import { post } from "../../../common/page/api";
import { announce, element } from "../../../common/page/dom";
import type { ScanView, StageView } from "./model";

function field(stage: string, name: string, value: unknown): HTMLElement | null {
  const common = { name: `${stage}.${name}`, "data-stage": stage, "data-option": name };
  let input: HTMLInputElement;
  if (typeof value === "boolean") input = element("input", { ...common, type: "checkbox", checked: value });
  else if (typeof value === "number") input = element("input", { ...common, type: "number", step: "any", value });
  else if (typeof value === "string") input = element("input", { ...common, type: "text", value });
  else return null;
  return element("label", { class: "field" }, element("span", {}, name.replaceAll("_", " ")), input);
}

function valueOf(input: HTMLInputElement): unknown {
  if (input.type === "checkbox") return input.checked;
  return input.type === "number" ? Number(input.value) : input.value;
}

function changedOptions(form: HTMLFormElement, stages: StageView[]): Record<string, Record<string, unknown>> {
  const changed: Record<string, Record<string, unknown>> = {};
  for (const input of form.querySelectorAll<HTMLInputElement>("input[data-stage]")) {
    const { stage, option } = input.dataset as { stage: string; option: string };
    const before = stages.find((one) => one.name === stage)?.options[option];
    const value = valueOf(input);
    if (value !== before) (changed[stage] ??= {})[option] = value;
  }
  return changed;
}

export function stagesPanel(scan: ScanView): HTMLElement {
  const busy = scan.phase === "running" || scan.phase === "queued" || scan.phase === "importing";
  const form = element(
    "form",
    { id: "stages" },
    ...scan.stages.map((stage) =>
      element(
        "details",
        {},
        element(
          "summary",
          {},
          stage.name,
          element("small", {}, stage.done ? ` done in ${stage.seconds.toFixed(1)} s` : " not done"),
        ),
        element("div", { class: "fields" }, ...Object.entries(stage.options).map(([name, value]) => field(stage.name, name, value))),
      ),
    ),
    element("button", { type: "submit", class: "primary", disabled: busy }, "Run again"),
    element("p", {}, busy ? "The scan is being worked on." : "Only the stages that a change touches are run."),
  );
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    post(`/api/scans/${scan.id}/rerun`, { options: changedOptions(form, scan.stages) })
      .then(() => announce("The scan will be run again."))
      .catch((error: Error) => announce(error.message, "bad"));
  });
  return form;
}
