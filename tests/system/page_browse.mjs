// SPDX-License-Identifier: Apache-2.0
// Walks through the host's page in Chromium as its user would, from a recording to a downloaded avatar, and prints what
// it saw as JSON. Pictures of what it saw go to FOLDER.
//
//   node page_browse.mjs send URL FOLDER VIDEO HEIGHT_MM   send the recording and wait for its avatar
//   node page_browse.mjs walk URL FOLDER VIDEO HEIGHT_MM   ... and use it, download it, run it again, delete it
//   node page_browse.mjs time URL FOLDER                   how fast the page is, with a finished scan in the store
import { statSync } from "node:fs";
import { join } from "node:path";
import { browser, complaints, desktop, drawn, isWide, minute, openPage, phone as phoneLook, seriousFaults } from "./browser.mjs";

const [mode, url, folder, video, height] = process.argv.slice(2);
if (!["send", "walk", "time"].includes(mode) || !folder || (mode !== "time" && !height)) {
  console.error("usage: node page_browse.mjs send|walk URL FOLDER VIDEO HEIGHT_MM | time URL FOLDER");
  process.exit(2);
}

const picture = (page, name) => page.locator(".stage").screenshot({ path: join(folder, `${name}.png`), timeout: minute });

async function send(page, seen) {
  await page.goto(url);
  await page.getByText("No scans yet").waitFor();
  seen.faults.empty = await seriousFaults(page);

  await page.getByText("Add a recording", { exact: true }).click();
  await page.locator('input[name="body"]').setInputFiles(video);
  await page.locator('input[name="height_mm"]').fill(height);
  seen.faults.upload = await seriousFaults(page);
  await page.getByRole("button", { name: "Make an avatar" }).click();
  await page.waitForURL(/#\/scan\/[0-9A-Z]{26}$/, { timeout: minute });
  seen.scan = page.url().slice(-26);

  // Progress arrives by itself.
  const phase = page.locator("[data-phase]").first();
  const now = () => phase.getAttribute("data-phase", { timeout: minute });
  for (let last = ""; !["done", "failed"].includes(last); ) {
    await page.waitForFunction((before) => document.querySelector("[data-phase]")?.dataset.phase !== before, last, { timeout: 30 * minute });
    last = await now();
    seen.phases.push(last);
  }
  if (seen.phases.at(-1) === "failed") seen.reason = await phase.textContent();
  return seen;
}

async function walk(page, seen) {
  await send(page, seen);
  await page.locator(".stage[data-loaded]").waitFor({ timeout: 3 * minute });
  await drawn(page);
  seen.faults.avatar = await seriousFaults(page);
  await page.evaluate(() => scrollTo(0, 0));
  await picture(page, "avatar");
  await page.getByRole("button", { name: "Face" }).click();
  await drawn(page);
  await picture(page, "face");
  await page.getByText("Expressions", { exact: true }).click();
  seen.expressions = await page.locator("input[data-expression]").count();
  await page.locator('input[data-expression="jawOpen"]').fill("1");
  await drawn(page);
  await page.evaluate(() => scrollTo(0, 0));
  await picture(page, "jaw");
  await page.getByRole("button", { name: "Neutral" }).click();
  await page.getByRole("button", { name: "Body" }).click();
  await page.getByRole("combobox", { name: "Motion" }).selectOption("wave");
  await page.waitForTimeout(1500);
  await picture(page, "wave");
  await page.getByRole("combobox", { name: "Motion" }).selectOption("none");
  await page.getByLabel("Skeleton").check();
  await drawn(page);
  await picture(page, "skeleton");
  await page.getByLabel("Skeleton").uncheck();
  await page.getByLabel("Texture sources").check();
  await page.waitForTimeout(500);
  await picture(page, "sources");
  await page.getByLabel("Texture sources").uncheck();

  await page.getByRole("tab", { name: "Report" }).click();
  await page.frameLocator("iframe.report").locator("h1").waitFor({ timeout: minute });
  seen.faults.report = await seriousFaults(page);
  await page.screenshot({ path: join(folder, "report.png") });
  await page.getByRole("tab", { name: "Stages" }).click();
  await page.locator("form#stages").waitFor();
  seen.faults.stages = await seriousFaults(page);
  await page.getByRole("tab", { name: "Landmarks" }).click();
  await page.locator(".picker .strip img").first().waitFor();
  seen.faults.landmarks = await seriousFaults(page);
  await page.screenshot({ path: join(folder, "landmarks.png") });

  await page.getByRole("tab", { name: "Files" }).click();
  seen.faults.files = await seriousFaults(page);
  for (const name of await page.locator("ul.files a").allTextContents()) {
    const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("link", { name, exact: true }).click()]);
    const file = join(folder, name);
    await download.saveAs(file);
    seen.downloads[name] = statSync(file).size;
  }

  // One option changed: the scan is run again and comes back done.
  await page.getByRole("tab", { name: "Stages" }).click();
  await page.locator("form#stages summary", { hasText: "avatar" }).click();
  await page.locator('input[name="avatar.levels_of_detail"]').check();
  await page.getByRole("button", { name: "Run again" }).click();
  await page.waitForFunction(() => document.querySelector("[data-phase]")?.dataset.phase !== "done", null, { timeout: minute });
  await page.waitForFunction(() => document.querySelector("[data-phase]")?.dataset.phase === "done", null, { timeout: 10 * minute });
  await page.getByRole("tab", { name: "Files" }).click();
  seen.after_run_again = await page.locator("ul.files a").allTextContents();

  const phone = await openPage(phoneLook);
  await phone.goto(url);
  await phone.locator("a.card").first().waitFor();
  await phone.screenshot({ path: join(folder, "phone-list.png") });
  seen.faults.phone_list = await seriousFaults(phone);
  await phone.locator("a.card").first().tap();
  await phone.locator(".stage[data-loaded]").waitFor({ timeout: 3 * minute });
  await drawn(phone);
  await phone.screenshot({ path: join(folder, "phone-avatar.png") });
  seen.faults.phone_avatar = await seriousFaults(phone);
  seen.phone_is_wide = await isWide(phone);

  await page.getByRole("button", { name: "Delete" }).click();
  await page.getByRole("dialog").getByRole("button", { name: "Delete" }).click();
  await page.getByText("No scans yet").waitFor({ timeout: minute });
  // The phone is told as well.
  await phone.getByText("No scans yet").waitFor({ timeout: minute });
  return seen;
}

async function time(page) {
  await page.goto("about:blank");
  const begin = Date.now();
  await page.goto(url, { waitUntil: "commit" });
  await page.locator("a.card").first().waitFor();
  const first = Date.now() - begin;
  await page.locator('a.card[data-phase="done"]').first().click();
  const asked = Date.now();
  await page.locator(".stage[data-loaded]").waitFor({ timeout: 3 * minute });
  await drawn(page);
  const avatar = Date.now() - asked;
  const scan = page.url().slice(-26);
  const bytes = Number((await (await fetch(`${url}scans/${scan}/avatar.glb`, { method: "HEAD" })).headers.get("content-length")) ?? 0);

  // How long a turn of the avatar takes to be seen.
  const turns = [];
  const box = await page.locator(".stage").boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  for (let i = 1; i <= 20; ++i) {
    const moved = Date.now();
    await page.mouse.move(box.x + box.width / 2 + 10 * i, box.y + box.height / 2);
    await drawn(page);
    turns.push(Date.now() - moved);
  }
  await page.mouse.up();
  turns.sort((a, b) => a - b);
  await picture(page, "timed");
  return { first_view_ms: first, avatar_drawn_ms: avatar, avatar_size_bytes: bytes, turn_ms: turns[10] };
}

try {
  const page = await openPage(desktop);
  const seen = await { send, walk, time }[mode](page, { faults: {}, downloads: {}, phases: [] });
  console.log(JSON.stringify({ ...seen, complaints }));
} finally {
  await browser.close();
}
