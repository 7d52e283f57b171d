// SPDX-License-Identifier: Apache-2.0
// What the host tells of its scans: see offload/page/scan_view.h.

export type Phase = "importing" | "receiving" | "queued" | "running" | "done" | "failed";

export interface ScanRow {
  id: string;
  device: string;
  created: string;
  phase: Phase;
  reason: string; // why it failed
  delivered: boolean;
  keyframes: number;
  cover: string; // a keyframe that shows the person; "" when there is none
  stage: string; // the one at work
  fraction: number;
  text: string;
  device_text: string; // what its device says while it records; "" when nothing
  coverage: Coverage | null; // what it has seen so far
  files: string[]; // results that can be downloaded
}

export interface Coverage {
  pass: string;
  bands: { name: string; share: number; cells: number[] }[]; // cells: 0 not seen to 255, by azimuth
}

export interface StageView {
  name: string;
  done: boolean;
  seconds: number;
  options: Record<string, unknown>; // that the page may set: their present values
}

export interface ScanView extends ScanRow {
  height_mm: number | null;
  stages: StageView[];
  warnings: string[];
  texture_sources: boolean;
}

export interface LandmarkFrame {
  name: string;
  width: number;
  height: number;
  azimuth_deg: number | null; // of the camera around the subject, 0 = from where the subject faces
  pixels: Record<string, [number, number]>; // where the placed landmarks are in it
}

export interface LandmarkView {
  names: string[];
  placed: Record<string, string>; // name -> source
  missing: Record<string, string>; // name -> why
  picked: Record<string, { pixels?: Record<string, [number, number]>; position?: [number, number, number] }>;
  frames: LandmarkFrame[];
}

const phases: Record<Phase, string> = {
  importing: "reading the recording",
  receiving: "arriving",
  queued: "waiting for its turn",
  running: "being made",
  done: "ready",
  failed: "failed",
};

export function describe(scan: ScanRow): string {
  if (scan.phase === "failed") return `failed: ${scan.reason}`;
  if ((scan.phase === "running" || scan.phase === "importing") && scan.stage) {
    return scan.text ? `${scan.stage}: ${scan.text}` : scan.stage;
  }
  if (scan.phase === "receiving") return [phases.receiving, scan.device_text, seen(scan)].filter(Boolean).join(" · ");
  return phases[scan.phase];
}

function seen(scan: ScanRow): string {
  const bands = scan.coverage?.bands.filter((band) => band.share > 0) ?? [];
  return bands.map((band) => `${band.name} ${Math.round(100 * band.share)} %`).join(", ");
}

export function when(created: string): string {
  const time = new Date(created);
  return Number.isNaN(time.getTime()) ? created : time.toLocaleString();
}

export const framePath = (id: string, frame: string, small: boolean) =>
  `/scans/${id}/frames/${frame}${small ? "?small=1" : ""}`;
