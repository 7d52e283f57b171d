// SPDX-License-Identifier: Apache-2.0
// What the rig tells of itself and its scans: see device/page/status_view.h and scan_rows.h.

export type State =
  | "idle"
  | "arming"
  | "pass"
  | "between_passes"
  | "finishing"
  | "waiting_for_host"
  | "avatar_ready"
  | "fault";

export interface Signal {
  colour: "off" | "white" | "green" | "blue" | "yellow" | "red";
  pattern: "steady" | "slow_blink" | "fast_blink" | "pulse";
  sentence: string;
}

export interface Condition extends Signal {
  name: string;
}

export interface BandCoverage {
  band: string;
  is_ring: boolean; // has to be seen all around
  cells: string; // a letter a sector: "." not seen, "~" seen and not sharp, "#" covered
  quality: string; // best of a sector, "0" to "9"
}

export interface Status {
  state: State;
  scan: string;
  pass: string;
  fault: string;
  notice: string;
  signal: Signal;
  conditions: Condition[]; // the most severe first
  azimuth_deg: number | null;
  sector: number | null; // the camera is in
  band: string; // likewise
  coverage: BandCoverage[];
  frames: number;
  keyframes: number;
  acknowledged: number;
  frames_per_second: number;
  disk_free_mib: number;
  host: { is_wanted: boolean; is_connected: boolean; text: string; stage: string; fraction: number };
}

export interface ScanRow {
  id: string;
  phase: "recording" | "closed" | "acknowledged" | "delivered" | "failed";
  reason: string; // why it failed
  keyframes: number;
  files: number;
  acknowledged: number; // of the files, by the host
  cover: string; // a keyframe that shows the person; "" when there is none
  results: string[];
  stage: string; // what the host does with it; "" when that is not known
  fraction: number;
}

export function describe(scan: ScanRow): string {
  if (scan.stage && scan.stage !== "upload") return `at the host: ${scan.stage}`;
  switch (scan.phase) {
    case "recording":
      return "being recorded";
    case "closed":
      return `${scan.acknowledged} of ${scan.files} files at the host`;
    case "acknowledged":
      return "at the host";
    case "delivered":
      return "ready";
    case "failed":
      return `failed: ${scan.reason}`;
  }
}

// How far a scan is that is on its way; nothing for one that is not.
export function progressOf(scan: ScanRow): number | null {
  if (scan.stage && scan.stage !== "upload") return scan.fraction;
  return scan.phase === "closed" && scan.files > 0 ? scan.acknowledged / scan.files : null;
}

// A scan's id begins with the time it was made at (github.com/ulid/spec).
export function timeOf(id: string): string {
  const letters = "0123456789ABCDEFGHJKMNPQRSTVWXYZ";
  let milliseconds = 0;
  for (const letter of id.slice(0, 10)) milliseconds = 32 * milliseconds + letters.indexOf(letter);
  return new Date(milliseconds).toLocaleString();
}
