// SPDX-License-Identifier: Apache-2.0
// A walk and a wave for any humanoid skeleton: they are given as directions of limbs in space, and put on a skeleton by
// turning each bone from where it points at rest to where it should point. No rest pose or axis of a bone is assumed.
import * as THREE from "three";

// Names of VRM 1.0's bones in other namings, as the avatar may carry them.
const other: Record<string, [string, string]> = {
  hips: ["mixamorig:Hips", "pelvis"],
  spine: ["mixamorig:Spine", "spine_01"],
  head: ["mixamorig:Head", "head"],
  leftUpperArm: ["mixamorig:LeftArm", "upperarm_l"],
  leftLowerArm: ["mixamorig:LeftForeArm", "lowerarm_l"],
  leftHand: ["mixamorig:LeftHand", "hand_l"],
  rightUpperArm: ["mixamorig:RightArm", "upperarm_r"],
  rightLowerArm: ["mixamorig:RightForeArm", "lowerarm_r"],
  rightHand: ["mixamorig:RightHand", "hand_r"],
  leftUpperLeg: ["mixamorig:LeftUpLeg", "thigh_l"],
  leftLowerLeg: ["mixamorig:LeftLeg", "calf_l"],
  leftFoot: ["mixamorig:LeftFoot", "foot_l"],
  rightUpperLeg: ["mixamorig:RightUpLeg", "thigh_r"],
  rightLowerLeg: ["mixamorig:RightLeg", "calf_r"],
  rightFoot: ["mixamorig:RightFoot", "foot_r"],
};

// What the limb's end is, and so where a bone points.
const child: Record<string, string> = {
  leftUpperArm: "leftLowerArm",
  leftLowerArm: "leftHand",
  rightUpperArm: "rightLowerArm",
  rightLowerArm: "rightHand",
  leftUpperLeg: "leftLowerLeg",
  leftLowerLeg: "leftFoot",
  rightUpperLeg: "rightLowerLeg",
  rightLowerLeg: "rightFoot",
};

// The subject faces +Z, up is +Y, its left is +X.
interface Pose {
  directions: Record<string, THREE.Vector3>; // of limbs, in space
  turns: Record<string, THREE.Euler>; // of other bones, in space, from rest
  onGround: boolean; // the hips go where the lower foot touches the floor
}

// A direction in the plane of walking: angle from straight down, forwards positive.
const swing = (angle: number, outwards = 0) =>
  new THREE.Vector3(outwards, -Math.cos(angle), Math.sin(angle)).normalize();

function walkPose(phase: number): Pose {
  const pose: Pose = { directions: {}, turns: {}, onGround: true };
  for (const [side, shift, sign] of [
    ["left", 0, 1],
    ["right", Math.PI, -1],
  ] as const) {
    const at = phase + shift;
    const thigh = 0.08 + 0.42 * Math.sin(at);
    // The knee gives a little under the body's weight and folds while the leg comes forwards.
    const knee = 0.12 + 0.95 * Math.max(0, Math.cos(at - 0.25)) ** 1.5;
    pose.directions[`${side}UpperLeg`] = swing(thigh);
    pose.directions[`${side}LowerLeg`] = swing(thigh - knee);
    pose.turns[`${side}Foot`] = new THREE.Euler(0.35 * Math.max(0, -Math.sin(at)) - 0.25 * Math.max(0, Math.sin(at)), 0, 0);
    const arm = -0.35 * Math.sin(at);
    pose.directions[`${side}UpperArm`] = swing(arm, 0.16 * sign);
    pose.directions[`${side}LowerArm`] = swing(arm + 0.35, 0.08 * sign);
  }
  pose.turns.spine = new THREE.Euler(0.03, 0.09 * Math.sin(phase), 0);
  pose.turns.hips = new THREE.Euler(0, -0.07 * Math.sin(phase), 0);
  return pose;
}

function wavePose(phase: number): Pose {
  const pose: Pose = { directions: {}, turns: {}, onGround: false };
  pose.directions.leftUpperArm = swing(0.03, 0.2);
  pose.directions.leftLowerArm = swing(0.18, 0.12);
  pose.directions.rightUpperArm = new THREE.Vector3(-1, 0.12, 0.22).normalize();
  pose.directions.rightLowerArm = new THREE.Vector3(-0.15 + 0.42 * Math.sin(2 * phase), 1, 0.15).normalize();
  pose.turns.head = new THREE.Euler(0, 0, 0.06 + 0.03 * Math.sin(phase));
  pose.turns.spine = new THREE.Euler(0, 0, 0.03 * Math.sin(phase));
  return pose;
}

export class Skeleton {
  private bones = new Map<string, THREE.Bone>();
  private restLocal = new Map<string, THREE.Quaternion>();
  private order: THREE.Bone[] = [];
  private restHips = new THREE.Vector3();
  private soles = 0; // height of the lower ankle at rest

  constructor(root: THREE.Object3D) {
    root.updateWorldMatrix(true, true);
    // three.js takes the colon out of a node's name.
    const names = new Map<string, string>();
    for (const [vrm, others] of Object.entries(other)) {
      for (const name of [vrm, ...others]) names.set(THREE.PropertyBinding.sanitizeNodeName(name), vrm);
    }
    root.traverse((node) => {
      if (!(node as THREE.Bone).isBone) return;
      const bone = node as THREE.Bone;
      this.order.push(bone);
      this.restLocal.set(bone.uuid, bone.quaternion.clone());
      const vrm = names.get(bone.name);
      if (vrm) this.bones.set(vrm, bone);
    });
    const hips = this.bones.get("hips");
    if (hips) this.restHips.copy(hips.position);
    this.soles = this.lowestAnkle();
  }

  get isHumanoid(): boolean {
    return Object.keys(other).every((name) => this.bones.has(name));
  }

  private place(name: string): THREE.Vector3 {
    return new THREE.Vector3().setFromMatrixPosition(this.bones.get(name)!.matrixWorld);
  }

  private lowestAnkle(): number {
    return Math.min(
      ...["leftFoot", "rightFoot"].filter((name) => this.bones.has(name)).map((name) => this.place(name).y),
    );
  }

  rest(): void {
    for (const bone of this.order) bone.quaternion.copy(this.restLocal.get(bone.uuid)!);
    this.bones.get("hips")?.position.copy(this.restHips);
    this.order[0]?.updateWorldMatrix(true, true);
  }

  // Turns a bone by a rotation given in space.
  private turn(bone: THREE.Bone, rotation: THREE.Quaternion): void {
    const parent = bone.parent!.getWorldQuaternion(new THREE.Quaternion());
    const world = bone.getWorldQuaternion(new THREE.Quaternion());
    bone.quaternion.copy(parent.invert().multiply(rotation.multiply(world)));
    bone.updateWorldMatrix(false, true);
  }

  private apply(pose: Pose): void {
    this.rest();
    for (const name of ["hips", "spine", "head"]) {
      const bone = this.bones.get(name);
      if (bone && pose.turns[name]) this.turn(bone, new THREE.Quaternion().setFromEuler(pose.turns[name]));
    }
    for (const [name, end] of Object.entries(child)) {
      const wanted = pose.directions[name];
      const bone = this.bones.get(name);
      if (!wanted || !bone) continue;
      const now = this.place(end).sub(this.place(name)).normalize();
      this.turn(bone, new THREE.Quaternion().setFromUnitVectors(now, wanted));
    }
    for (const name of ["leftFoot", "rightFoot"]) {
      const bone = this.bones.get(name);
      if (!bone || !pose.turns[name]) continue;
      // A foot is held as at rest and then turned, whatever the shin does.
      const rest = this.restWorld.get(name);
      if (!rest) continue;
      const world = bone.getWorldQuaternion(new THREE.Quaternion());
      const wanted = new THREE.Quaternion().setFromEuler(pose.turns[name]).multiply(rest);
      this.turn(bone, wanted.multiply(world.invert()));
    }
    if (pose.onGround) this.lower(this.lowestAnkle() - this.soles);
  }

  private lower(distance: number): void {
    const hips = this.bones.get("hips");
    if (!hips?.parent) return;
    const at = new THREE.Vector3().setFromMatrixPosition(hips.matrixWorld);
    at.y -= distance;
    hips.position.copy(hips.parent.worldToLocal(at));
    hips.updateWorldMatrix(false, true);
  }

  private restWorld = new Map<string, THREE.Quaternion>();

  // An animation that repeats itself. seconds: of one cycle.
  clip(name: string, seconds: number, poseAt: (phase: number) => Pose): THREE.AnimationClip {
    this.rest();
    for (const foot of ["leftFoot", "rightFoot"]) {
      const bone = this.bones.get(foot);
      if (bone) this.restWorld.set(foot, bone.getWorldQuaternion(new THREE.Quaternion()));
    }
    const steps = 32;
    const times: number[] = [];
    const turns = new Map<THREE.Bone, number[]>();
    const places: number[] = [];
    const hips = this.bones.get("hips");
    for (let i = 0; i <= steps; ++i) {
      times.push((i / steps) * seconds);
      this.apply(poseAt((2 * Math.PI * i) / steps));
      for (const bone of this.bones.values()) {
        if (!turns.has(bone)) turns.set(bone, []);
        turns.get(bone)!.push(...bone.quaternion.toArray());
      }
      if (hips) places.push(...hips.position.toArray());
    }
    this.rest();
    const tracks: THREE.KeyframeTrack[] = [];
    for (const [bone, values] of turns) {
      tracks.push(new THREE.QuaternionKeyframeTrack(`${bone.uuid}.quaternion`, times, values));
    }
    if (hips) tracks.push(new THREE.VectorKeyframeTrack(`${hips.uuid}.position`, times, places));
    return new THREE.AnimationClip(name, seconds, tracks);
  }

  walk(): THREE.AnimationClip {
    return this.clip("walk", 1.15, walkPose);
  }

  wave(): THREE.AnimationClip {
    return this.clip("wave", 1.6, wavePose);
  }
}
