// SPDX-License-Identifier: Apache-2.0
// Makes elements. Text is always text, never markup.

type Child = Node | string | null | undefined | false;
type Handler = (event: Event) => void;
type Properties = Record<string, string | number | boolean | Handler | undefined>;

// element("button", { class: "big", onclick: start, disabled: false }, "Start")
export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Properties = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (value === undefined || value === false) continue;
    if (typeof value === "function") made.addEventListener(name.replace(/^on/, ""), value);
    else made.setAttribute(name, value === true ? "" : String(value));
  }
  made.append(...children.filter((child): child is Node | string => !!child || child === ""));
  return made;
}

export function replace(parent: Element, ...children: Child[]): void {
  parent.replaceChildren(...children.filter((child): child is Node | string => !!child || child === ""));
}

// A message that is read out and goes by itself.
export function announce(text: string, kind: "good" | "bad" = "good"): void {
  let region = document.getElementById("messages");
  if (!region) {
    region = element("div", { id: "messages", role: "status", "aria-live": "polite" });
    document.body.append(region);
  }
  const message = element("p", { class: `message ${kind}` }, text);
  region.append(message);
  setTimeout(() => message.remove(), 8000);
}
