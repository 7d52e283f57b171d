// SPDX-License-Identifier: Apache-2.0
// Makes a scan of recordings that lie on the browser's side.
import { post, remove, sendFile } from "../../../common/page/api";
import { announce, element } from "../../../common/page/dom";

function fileField(label: string, name: string, required: boolean, hint: string): HTMLElement {
  return element(
    "label",
    { class: "field" },
    element("span", {}, label),
    element("input", { type: "file", name, accept: "video/*,.mkv", required }),
    element("small", {}, hint),
  );
}

async function send(form: HTMLFormElement, progress: HTMLProgressElement): Promise<void> {
  const data = new FormData(form);
  const body = data.get("body") as File;
  const head = data.get("head") as File | null;
  const height = Number(data.get("height_mm"));
  const files: [string, File][] = [["body", body]];
  if (head && head.size > 0) files.push(["head", head]);
  const total = files.reduce((sum, [, file]) => sum + file.size, 0);
  const { upload } = await post<{ upload: string }>("/api/uploads", { bytes: total });
  try {
    let sent = 0;
    for (const [pass, file] of files) {
      const kind = /\.[a-z0-9]{1,4}$/i.exec(file.name)?.[0].slice(1).toLowerCase() ?? "mp4";
      await sendFile(`/api/uploads/${upload}/${pass}?kind=${kind}`, file, (fraction) => {
        progress.value = (sent + fraction * file.size) / Math.max(1, total);
      });
      sent += file.size;
    }
    const { scan } = await post<{ scan: string }>(`/api/uploads/${upload}/finish`, {
      height_mm: height > 0 ? height : null,
    });
    location.hash = `#/scan/${scan}`;
  } catch (error) {
    await remove(`/api/uploads/${upload}`).catch(() => undefined);
    throw error;
  }
}

export function uploadForm(): HTMLElement {
  const progress = element("progress", { max: 1, value: 0, hidden: true, "aria-label": "Progress of the upload" });
  const button = element("button", { type: "submit", class: "primary" }, "Make an avatar");
  const form = element(
    "form",
    { id: "upload" },
    fileField("Body pass", "body", true, "A video of a walk around the whole person."),
    fileField("Head pass", "head", false, "A video of a walk around the head; makes the face better."),
    element(
      "label",
      { class: "field" },
      element("span", {}, "Stature in millimetres"),
      element("input", { type: "number", name: "height_mm", min: 300, max: 2600, step: 1, inputmode: "numeric" }),
      element("small", {}, "From the soles to the top of the hair. Without it an average is assumed."),
    ),
    element("div", { class: "row" }, button, progress),
  );
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    button.disabled = true;
    progress.hidden = false;
    send(form, progress)
      .catch((error: Error) => announce(error.message, "bad"))
      .finally(() => {
        button.disabled = false;
        progress.hidden = true;
      });
  });
  return element("details", { class: "upload" }, element("summary", {}, "Add a recording"), form);
}
