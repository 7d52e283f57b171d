// SPDX-License-Identifier: Apache-2.0
// Takes a scan from the rig's page on a phone in Chromium, until its avatar is back, and prints what it saw as JSON.
// Pictures of what it saw go to FOLDER.
//
//   node rig_browse.mjs URL FOLDER
import { join } from "node:path";
import { browser, complaints, drawn, isWide, minute, openPage, phone, seriousFaults } from "./browser.mjs";

const [url, folder] = process.argv.slice(2);
if (!folder) {
  console.error("usage: node rig_browse.mjs URL FOLDER");
  process.exit(2);
}

async function walk(page) {
  const seen = { faults: {} };
  const button = page.locator("button.thumb");
  const command = (name) => page.locator(`button.thumb[data-command="${name}"]`).waitFor({ timeout: 2 * minute });
  const shot = (name) => page.screenshot({ path: join(folder, `rig-${name}.png`) });

  await page.goto(url);
  await command("start");
  seen.ready = await page.locator(".sentence").textContent();
  seen.is_wide = await isWide(page);
  seen.faults.idle = await seriousFaults(page);
  await page.getByLabel("Stature of the person").fill("1700");
  await button.tap();
  await command("stop");
  await page.locator(".preview img[data-number]").waitFor();
  seen.first_picture = Number(await page.locator(".preview img").getAttribute("data-number"));
  await page.waitForFunction((first) => Number(document.querySelector(".preview img").dataset.number) > first + 5, seen.first_picture, { timeout: minute });
  await shot("pass");
  seen.faults.pass = await seriousFaults(page);
  // The recording ends by itself; what it covered stays to be seen until the next pass.
  await command("start");
  seen.between = await page.locator(".signal").getAttribute("data-state");
  await page.getByRole("button", { name: "No more" }).tap();
  seen.faults.question = await seriousFaults(page);
  await page.locator("#confirm").tap();
  await page.locator('.signal[data-state="waiting_for_host"]').waitFor({ timeout: minute });
  await shot("waiting");
  seen.faults.waiting = await seriousFaults(page);

  await page.locator('.signal[data-state="avatar_ready"]').waitFor({ timeout: 10 * minute });
  await shot("ready");
  await page.getByRole("link", { name: "Look at the avatar" }).tap();
  await page.locator(".stage[data-loaded]").waitFor({ timeout: 3 * minute });
  await drawn(page);
  await shot("avatar");
  seen.faults.avatar = await seriousFaults(page);
  seen.results = await page.locator("ul.files a").allTextContents();
  await page.getByRole("link", { name: "All scans" }).tap();
  await page.locator("a.card").first().waitFor();
  seen.scans = await page.locator("a.card").count();
  seen.faults.scans = await seriousFaults(page);
  return seen;
}

try {
  console.log(JSON.stringify({ ...(await walk(await openPage(phone))), complaints }));
} finally {
  await browser.close();
}
