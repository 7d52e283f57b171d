// SPDX-License-Identifier: Apache-2.0
// Chromium as the page tests use it.
import { AxeBuilder } from "@axe-core/playwright";
import { chromium } from "playwright-core";

export const minute = 60_000;

export const phone = { viewport: { width: 390, height: 844 }, isMobile: true, hasTouch: true, deviceScaleFactor: 2 };
export const desktop = { viewport: { width: 1280, height: 800 }, acceptDownloads: true };

// What pages complained of in the console.
export const complaints = [];

export const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});

export async function openPage(options) {
  const page = await (await browser.newContext(options)).newPage();
  page.on("console", (message) => message.type() === "error" && complaints.push(message.text()));
  page.on("pageerror", (error) => complaints.push(String(error)));
  return page;
}

// Faults of accessibility that keep somebody from using the page.
export async function seriousFaults(page) {
  const { violations } = await new AxeBuilder({ page }).analyze();
  return violations.filter((v) => ["serious", "critical"].includes(v.impact)).map((v) => v.id);
}

// Until what was asked for is drawn.
export const drawn = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

export const isWide = (page) => page.evaluate(() => document.scrollingElement.scrollWidth > innerWidth);
