// SPDX-License-Identifier: Apache-2.0
// Runs the Khronos validator on a GLB and prints its report as JSON. Exit code 1 when it has errors.
//
//   node gltf_validate.mjs FILE.glb
import { readFile } from "node:fs/promises";
import { validateBytes } from "gltf-validator";

const file = process.argv[2];
if (!file) {
  console.error("usage: node gltf_validate.mjs FILE.glb");
  process.exit(2);
}
const report = await validateBytes(new Uint8Array(await readFile(file)), { uri: file, maxIssues: 100 });
console.log(JSON.stringify(report, null, 1));
process.exit(report.issues.numErrors > 0 ? 1 : 0);
