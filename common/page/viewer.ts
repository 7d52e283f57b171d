// SPDX-License-Identifier: Apache-2.0
// The avatar in 3D: looked at from all sides, moved, with its expressions, skeleton, wires and texture sources.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { element, replace } from "./dom";
import { Skeleton } from "./clips";

export type Motion = "none" | "walk" | "wave";

export class AvatarViewer {
  readonly canvas: HTMLCanvasElement;
  private renderer: THREE.WebGLRenderer;
  private scene = new THREE.Scene();
  private camera = new THREE.PerspectiveCamera(30, 1, 0.02, 50);
  private controls: OrbitControls;
  private clock = new THREE.Clock();
  private mixer?: THREE.AnimationMixer;
  private skeleton?: Skeleton;
  private bonesDrawn?: THREE.SkeletonHelper;
  private meshes: THREE.Mesh[] = [];
  private photographs = new Map<THREE.MeshStandardMaterial, THREE.Texture | null>();
  private sources?: THREE.Texture;
  private frame = 0;
  private sized: ResizeObserver;
  private needsDrawing = true;
  private moving = false;

  constructor(parent: HTMLElement) {
    this.canvas = element("canvas", {
      class: "viewer",
      tabindex: 0,
      role: "img",
      "aria-label": "The avatar in 3D. Drag to turn it, pinch or scroll to come nearer, arrow keys to turn.",
    });
    parent.append(this.canvas);
    this.renderer = new THREE.WebGLRenderer({ canvas: this.canvas, antialias: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.scene.background = new THREE.Color(0x20242a);
    // The light is in the photographs already: nearly all of it comes from everywhere.
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0xe0e0e0, 2.6));
    const key = new THREE.DirectionalLight(0xffffff, 0.5);
    key.position.set(1, 2, 3);
    this.scene.add(key);
    const floor = new THREE.GridHelper(4, 16, 0x59616b, 0x363c44);
    this.scene.add(floor);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enableDamping = true;
    this.controls.minDistance = 0.25;
    this.controls.maxDistance = 12;
    this.controls.addEventListener("change", () => (this.needsDrawing = true));
    this.canvas.addEventListener("keydown", (event) => this.turnByKey(event));
    this.lookAtBody();
    this.sized = new ResizeObserver(() => this.resize());
    this.sized.observe(parent);
    this.resize();
    this.loop();
  }

  async load(url: string, progress: (fraction: number) => void): Promise<void> {
    const loader = new GLTFLoader();
    const gltf = await loader.loadAsync(url, (event) => event.total > 0 && progress(event.loaded / event.total));
    this.scene.add(gltf.scene);
    gltf.scene.traverse((node) => {
      const mesh = node as THREE.Mesh;
      if (!mesh.isMesh) return;
      mesh.frustumCulled = false; // its bounds are those at rest
      this.meshes.push(mesh);
      const material = mesh.material as THREE.MeshStandardMaterial;
      this.photographs.set(material, material.map);
    });
    this.skeleton = new Skeleton(gltf.scene);
    this.bonesDrawn = new THREE.SkeletonHelper(gltf.scene);
    this.bonesDrawn.visible = false;
    this.scene.add(this.bonesDrawn);
    this.mixer = new THREE.AnimationMixer(gltf.scene);
    this.needsDrawing = true;
  }

  get canMove(): boolean {
    return this.skeleton?.isHumanoid ?? false;
  }

  // Names of the expressions in the order of the file.
  get expressions(): string[] {
    const names = new Set<string>();
    for (const mesh of this.meshes) for (const name of Object.keys(mesh.morphTargetDictionary ?? {})) names.add(name);
    return [...names];
  }

  setExpression(name: string, weight: number): void {
    for (const mesh of this.meshes) {
      const index = mesh.morphTargetDictionary?.[name];
      if (index !== undefined && mesh.morphTargetInfluences) mesh.morphTargetInfluences[index] = weight;
    }
    this.needsDrawing = true;
  }

  setMotion(motion: Motion): void {
    this.mixer?.stopAllAction();
    this.skeleton?.rest();
    this.moving = motion !== "none";
    if (motion !== "none" && this.skeleton && this.mixer) {
      const clip = motion === "walk" ? this.skeleton.walk() : this.skeleton.wave();
      this.mixer.clipAction(clip).play();
    }
    this.needsDrawing = true;
  }

  showSkeleton(shown: boolean): void {
    if (this.bonesDrawn) this.bonesDrawn.visible = shown;
    this.needsDrawing = true;
  }

  showWires(shown: boolean): void {
    for (const material of this.photographs.keys()) material.wireframe = shown;
    this.needsDrawing = true;
  }

  // Puts a map of where each texel comes from in the texture's place, or takes it away again.
  async showSources(url: string | null): Promise<void> {
    if (url && !this.sources) {
      this.sources = await new THREE.TextureLoader().loadAsync(url);
      this.sources.flipY = false;
      this.sources.colorSpace = THREE.SRGBColorSpace;
      this.sources.magFilter = THREE.NearestFilter;
    }
    for (const [material, photograph] of this.photographs) {
      material.map = url ? this.sources! : photograph;
      material.needsUpdate = true;
    }
    this.needsDrawing = true;
  }

  private bounds(): THREE.Box3 {
    const box = new THREE.Box3();
    for (const mesh of this.meshes) box.expandByObject(mesh);
    return box.isEmpty() ? new THREE.Box3(new THREE.Vector3(-0.5, 0, -0.2), new THREE.Vector3(0.5, 1.75, 0.2)) : box;
  }

  lookAtBody(): void {
    const box = this.bounds();
    const middle = box.getCenter(new THREE.Vector3());
    this.look(middle, 1.25 * box.getSize(new THREE.Vector3()).y);
  }

  lookAtFace(): void {
    const box = this.bounds();
    const height = box.max.y - box.min.y;
    this.look(new THREE.Vector3(0, box.max.y - 0.075 * height, 0), 0.26 * height);
  }

  // height: metres of the picture at the target
  private look(target: THREE.Vector3, height: number): void {
    const distance = height / 2 / Math.tan(((this.camera.fov / 2) * Math.PI) / 180);
    this.camera.position.set(target.x, target.y, target.z + distance);
    this.controls.target.copy(target);
    this.controls.update();
    this.needsDrawing = true;
  }

  private turnByKey(event: KeyboardEvent): void {
    const turn = { ArrowLeft: -0.2, ArrowRight: 0.2 }[event.key];
    if (turn === undefined) return;
    event.preventDefault();
    const arm = this.camera.position.clone().sub(this.controls.target);
    arm.applyAxisAngle(new THREE.Vector3(0, 1, 0), turn);
    this.camera.position.copy(this.controls.target).add(arm);
    this.controls.update();
  }

  private resize(): void {
    const parent = this.canvas.parentElement;
    if (!parent) return;
    const { clientWidth: width, clientHeight: height } = parent;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.needsDrawing = true;
  }

  // Draws when something has changed, so that a page left open costs nothing.
  private loop(): void {
    this.frame = requestAnimationFrame(() => this.loop());
    const seconds = this.clock.getDelta();
    if (this.moving) {
      this.mixer?.update(seconds);
      this.needsDrawing = true;
    }
    this.controls.update();
    if (!this.needsDrawing) return;
    this.needsDrawing = false;
    this.renderer.render(this.scene, this.camera);
  }

  dispose(): void {
    cancelAnimationFrame(this.frame);
    this.sized.disconnect();
    this.controls.dispose();
    for (const mesh of this.meshes) mesh.geometry.dispose();
    for (const [material, photograph] of this.photographs) {
      photograph?.dispose();
      material.dispose();
    }
    this.sources?.dispose();
    this.renderer.dispose();
    this.canvas.remove();
  }
}

function toggle(label: string, change: (on: boolean) => void): HTMLElement {
  const input = element("input", { type: "checkbox", onchange: (event) => change((event.target as HTMLInputElement).checked) });
  return element("label", { class: "toggle" }, input, label);
}

function expressionSliders(viewer: AvatarViewer): HTMLElement {
  const list = element("div", { class: "sliders" });
  const fill = (wanted: string) =>
    replace(
      list,
      ...viewer.expressions
        .filter((name) => name.toLowerCase().includes(wanted.toLowerCase()))
        .map((name) =>
          element(
            "label",
            { class: "slider" },
            element("span", {}, name),
            element("input", {
              type: "range",
              min: 0,
              max: 1,
              step: 0.01,
              value: 0,
              "data-expression": name,
              oninput: (event) => viewer.setExpression(name, Number((event.target as HTMLInputElement).value)),
            }),
          ),
        ),
    );
  fill("");
  const search = element("input", {
    type: "search",
    placeholder: "jaw, blink, smile …",
    "aria-label": "Find an expression",
    oninput: (event) => fill((event.target as HTMLInputElement).value),
  });
  const reset = element(
    "button",
    {
      type: "button",
      onclick: () => {
        for (const name of viewer.expressions) viewer.setExpression(name, 0);
        fill(search.value);
      },
    },
    "Neutral",
  );
  return element("details", { class: "expressions" }, element("summary", {}, "Expressions"), element("div", { class: "row" }, search, reset), list);
}

// The viewer with its controls in `parent`. sources: picture of the texels' sources, when there is one. Call the result
// to take it away.
export function showAvatar(parent: HTMLElement, url: string, sources?: string): () => void {
  const stage = element("div", { class: "stage" });
  const state = element("p", { class: "loading", role: "status" }, "Loading the avatar …");
  const panel = element("div", { class: "viewer-panel" });
  replace(parent, element("div", { class: "viewer-frame" }, stage, state), panel);
  let viewer: AvatarViewer;
  try {
    viewer = new AvatarViewer(stage);
  } catch {
    state.textContent = "This browser cannot draw in 3D (WebGL is off). The avatar can be downloaded.";
    return () => undefined;
  }
  void viewer
    .load(url, (fraction) => (state.textContent = `Loading the avatar … ${Math.round(100 * fraction)} %`))
    .then(() => {
      state.remove();
      viewer.lookAtBody();
      stage.dataset.loaded = "true";
      const motions = element(
        "select",
        { "aria-label": "Motion", onchange: (event) => viewer.setMotion((event.target as HTMLSelectElement).value as Motion) },
        element("option", { value: "none" }, "Still"),
        element("option", { value: "walk" }, "Walk"),
        element("option", { value: "wave" }, "Wave"),
      );
      replace(
        panel,
        element(
          "div",
          { class: "row" },
          element("button", { type: "button", onclick: () => viewer.lookAtBody() }, "Body"),
          element("button", { type: "button", onclick: () => viewer.lookAtFace() }, "Face"),
          viewer.canMove && motions,
          toggle("Skeleton", (on) => viewer.showSkeleton(on)),
          toggle("Wires", (on) => viewer.showWires(on)),
          sources ? toggle("Texture sources", (on) => void viewer.showSources(on ? sources : null)) : null,
        ),
        viewer.expressions.length > 0 && expressionSliders(viewer),
      );
    })
    .catch((error: unknown) => (state.textContent = `The avatar could not be loaded: ${String(error)}`));
  return () => viewer.dispose();
}
