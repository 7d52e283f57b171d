// SPDX-License-Identifier: Apache-2.0
// Loads a VRM with three-vrm and prints what it found as JSON: humanoid bones with their places, expressions with what
// they bind, and the licence.
//
//   node vrm_load.mjs FILE.vrm
import { readFile } from "node:fs/promises";

// three.js expects a browser around it; pictures are not looked at here.
globalThis.self = globalThis;
globalThis.document = { createElementNS: () => ({ addEventListener(type, done) { if (type === "load") this.done = done; },
  removeEventListener() {}, set src(_) { this.done?.call(this); } }) };
URL.createObjectURL = () => "blob:";
URL.revokeObjectURL = () => {};

const { GLTFLoader } = await import("three/examples/jsm/loaders/GLTFLoader.js");
const { VRMLoaderPlugin } = await import("@pixiv/three-vrm");
const { Vector3 } = await import("three");

const file = process.argv[2];
if (!file) {
  console.error("usage: node vrm_load.mjs FILE.vrm");
  process.exit(2);
}
const bytes = await readFile(file);
const loader = new GLTFLoader();
loader.register((parser) => new VRMLoaderPlugin(parser));
const gltf = await loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength), "");
const vrm = gltf.userData.vrm;
vrm.scene.updateMatrixWorld(true);
const bones = {};
for (const [name, bone] of Object.entries(vrm.humanoid.humanBones))
  bones[name] = bone.node.getWorldPosition(new Vector3()).toArray();
const expressions = {};
for (const [name, expression] of Object.entries(vrm.expressionManager?.expressionMap ?? {}))
  expressions[name] = expression._binds.length;
console.log(JSON.stringify({ meta: vrm.meta, bones, expressions, look_at: vrm.lookAt !== undefined }));
