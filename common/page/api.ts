// SPDX-License-Identifier: Apache-2.0
// Talks to the program that served the page.

// Only the page itself can send this header: see common/http/access.h.
const mark = { "X-Gyre": "1" };

async function answerOf(response: Response): Promise<unknown> {
  const text = await response.text();
  const json = text && response.headers.get("Content-Type")?.startsWith("application/json") ? JSON.parse(text) : null;
  if (!response.ok) throw new Error(json?.error ?? `the program answered ${response.status}`);
  return json;
}

export async function request<T>(method: string, path: string, body?: unknown): Promise<T> {
  const response = await fetch(path, {
    method,
    headers: { ...mark, "Content-Type": "application/json" },
    body: body === undefined ? undefined : JSON.stringify(body),
  });
  return (await answerOf(response)) as T;
}

export const get = <T>(path: string) => request<T>("GET", path);
export const post = <T>(path: string, body: unknown = {}) => request<T>("POST", path, body);
export const put = <T>(path: string, body: unknown) => request<T>("PUT", path, body);
export const remove = <T>(path: string) => request<T>("DELETE", path);

// Sends a file and says how far it is: fetch cannot.
export function sendFile(path: string, file: Blob, progress: (fraction: number) => void): Promise<void> {
  return new Promise((resolve, reject) => {
    const sending = new XMLHttpRequest();
    sending.open("PUT", path);
    for (const [name, value] of Object.entries(mark)) sending.setRequestHeader(name, value);
    sending.upload.onprogress = (event) => event.lengthComputable && progress(event.loaded / event.total);
    sending.onload = () => {
      if (sending.status < 300) return resolve();
      let message = `the program answered ${sending.status}`;
      try {
        message = JSON.parse(sending.responseText).error ?? message;
      } catch {
        // it said nothing that could be shown
      }
      reject(new Error(message));
    };
    sending.onerror = () => reject(new Error("the connection was lost; nothing was kept, send it again"));
    sending.send(file);
  });
}

// Listens for events by name. onState: whether the program can be reached.
export function listen(
  path: string,
  handlers: Record<string, (data: never) => void>,
  onState: (connected: boolean) => void,
): EventSource {
  const source = new EventSource(path);
  source.onopen = () => onState(true);
  source.onerror = () => onState(false); // the browser tries again by itself
  for (const [name, handler] of Object.entries(handlers)) {
    source.addEventListener(name, (event) => handler(JSON.parse((event as MessageEvent).data) as never));
  }
  return source;
}
