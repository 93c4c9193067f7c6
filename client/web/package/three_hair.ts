// StrandcastHair: a stream as an object of three.js (declared in hair.d.ts). A worker makes each state ready; hair and head are
// drawn with the page's shaders into half floats, against the depths of what else is opaque in the scene, and then laid over it.
import * as THREE from 'three';
import { compileCore } from '../page/core';
import headFrag from 'client/web/page/gl/head.frag.glsl';
import headVert from 'client/web/page/gl/head.vert.glsl';
import resolveVert from 'client/web/page/gl/resolve.vert.glsl';
import strandFrag from 'client/web/page/gl/strand.frag.glsl';
import hairVert from 'client/web/package/hair.vert.glsl';
import overFrag from 'client/web/package/over.frag.glsl';
import tileFrame from 'shaders/render/tile_frame.glsl';
import { shaderText } from '../page/gl/shader_text';
import { filesOf, startWorker } from './connect';
import type { UserConnection } from './connection';
import { POINTS_PER_ROW, STRANDS_PER_ROW, type FromPrepare, type Prepared, type ToPrepare } from './prepare';
import type { Camera, Connection, State, Vec3 } from './strandcast';
import type { HairOptions } from './hair';

const SAMPLES = 4;
const all = THREE as unknown as { [name: string]: unknown }; // names that came or went with its versions
const Texture3D = (all.Data3DTexture ?? all.DataTexture3D) as typeof THREE.DataTexture3D;
const Target = (all.WebGLMultisampleRenderTarget ?? all.WebGLRenderTarget) as typeof THREE.WebGLRenderTarget;

/** A shader as this version of three takes it; the picture's block as plain uniforms, since older ones have no blocks. */
function textFor(text: string): string {
  const plain = shaderText(text).replace(/layout\(std140\) ?uniform TileFrameBlock/, 'struct TileFrameBlock')
    .replace(/^ *uvec4 \w+;/gm, '') // older ones cannot set them, and nothing here reads them
    .replace(/\} ?u_frame;/, '};\nuniform TileFrameBlock u_frame;');
  return 'GLSL3' in THREE ? plain.replace(/^#version 300 es\n/, '') : plain;
}
function materialOf(vertexShader: string, fragmentShader: string, uniforms: object, options: object): THREE.RawShaderMaterial {
  const material = new THREE.RawShaderMaterial({ vertexShader: textFor(vertexShader), fragmentShader: textFor(fragmentShader), uniforms, ...options });
  if ('GLSL3' in THREE) (material as unknown as { glslVersion: unknown }).glslVersion = all.GLSL3;
  return material;
}

/** Members of the block with their places in it, by its own declaration (std140: all are whole vectors). */
const FIELDS = [...(/TileFrameBlock ?\{([^}]*)\}/.exec(tileFrame)?.[1] ?? '').matchAll(/(mat4|[iu]?vec4) (\w+)(?:\[(\d+)\])?;/g)]
  .map(([, type, name, count]) => ({ name: name!, isWhole: type !== 'vec4' && type !== 'mat4', floats: (type === 'mat4' ? 16 : 4) * Number(count ?? 1) }));
type Frame = { [name: string]: Float32Array | Int32Array };
function frameOf(block: ArrayBuffer): Frame {
  const frame: Frame = {};
  let at = 0;
  for (const { name, isWhole, floats } of FIELDS) {
    frame[name] = isWhole ? new Int32Array(block, at, floats) : new Float32Array(block, at, floats);
    at += 4 * floats;
  }
  return frame;
}

function textureOf(data: ArrayBufferView, width: number, height: number, format: number): THREE.DataTexture {
  const texture = new THREE.DataTexture(data, width, height, format, THREE.FloatType);
  texture.needsUpdate = true;
  return texture;
}
function depthOf({ data, size }: { data: Uint16Array; size: readonly [number, number, number] }): THREE.DataTexture3D {
  const texture = new Texture3D(data, ...size);
  Object.assign(texture, { format: THREE.RedFormat, type: THREE.HalfFloatType, minFilter: THREE.LinearFilter, magFilter: THREE.LinearFilter, unpackAlignment: 1 });
  texture.needsUpdate = true;
  return texture;
}
/** Of a mesh whose places are none of three's business. */
function geometryOf(index: Uint32Array | undefined): THREE.BufferGeometry {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(9), 3));
  geometry.setIndex(new THREE.BufferAttribute(index ?? new Uint32Array([0, 1, 2]), 1));
  return geometry;
}
function meshOf(geometry: THREE.BufferGeometry, material: THREE.Material, isLines = false): THREE.Mesh {
  const mesh = isLines ? new THREE.LineSegments(geometry, material) : new THREE.Mesh(geometry, material);
  mesh.frustumCulled = false;
  return mesh;
}

export class StrandcastHair extends THREE.Object3D {
  private readonly worker: Worker;
  private readonly ends: (() => void)[] = [];
  private readonly uniforms = {
    u_frame: { value: undefined as Frame | undefined }, u_points: { value: null as THREE.Texture | null }, u_strands: { value: null as THREE.Texture | null },
    u_order: { value: null as THREE.Texture | null }, u_strand_of: { value: null as THREE.Texture | null }, u_least_m: { value: [0, 0, 0] }, u_step_m: { value: [0, 0, 0] },
    u_is_line: { value: false }, u_key_depth: { value: null as THREE.Texture | null }, u_rim_depth: { value: null as THREE.Texture | null }, u_sky_depth: { value: null as THREE.Texture | null },
  };
  private readonly blend = { transparent: true, depthTest: true, depthWrite: false, blending: THREE.CustomBlending, blendSrc: THREE.OneFactor,
    blendDst: THREE.OneMinusSrcAlphaFactor, blendSrcAlpha: THREE.OneFactor, blendDstAlpha: THREE.OneMinusSrcAlphaFactor, side: THREE.DoubleSide };
  private readonly strands: THREE.Mesh;
  private readonly skin = meshOf(geometryOf(undefined), materialOf(headVert, headFrag, this.uniforms, { side: THREE.DoubleSide, blending: THREE.NoBlending }));
  private readonly own = new THREE.Scene(); // of what goes into half floats
  private readonly target = new Target(1, 1, { type: THREE.HalfFloatType, minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter });
  private readonly depthOnly = new THREE.MeshBasicMaterial({ colorWrite: false });
  private readonly eye = Object.assign(new THREE.PerspectiveCamera(), { matrixAutoUpdate: false });
  private readonly over: THREE.Mesh;
  private readonly size = new THREE.Vector2();
  private readonly matrix4 = new THREE.Matrix4();
  private readonly vector = new THREE.Vector3();
  private next?: State; // newest, not yet with the worker
  private asked?: State; // with the worker
  private answered?: State; // back from it
  private isDisposed = false;
  private rotation: readonly number[] = [1, 0, 0, 0];
  private prepared: Prepared[] = [];
  private isReady = false; // the worker has an asset and a state
  private isBusy = false;
  private viewed = '';
  /** The one that is shown. */
  state?: State;
  /** Main thread's time of the newest picture, ms. */
  drawMs = 0;

  constructor(readonly connection: Connection, private readonly options: HairOptions = {}) {
    super();
    (connection as UserConnection).followVisibility();
    const files = filesOf(options.files);
    this.worker = startWorker(files, 'draw.js', 'prepare');
    this.worker.onmessage = ({ data }: MessageEvent<FromPrepare>) => this.hear(data);
    Object.assign(this.target, { samples: SAMPLES });
    this.target.texture.generateMipmaps = false;
    const isLine = (this.uniforms.u_is_line.value = options.style === 'lines');
    this.strands = meshOf(geometryOf(undefined), materialOf(hairVert, strandFrag, this.uniforms, this.blend), isLine);
    this.own.add(this.skin, this.strands);
    this.skin.visible = options.head === true;
    this.over = meshOf(geometryOf(undefined), materialOf(resolveVert, overFrag,
      { u_scene: { value: this.target.texture }, u_is_screen: { value: true } }, { ...this.blend, depthTest: false }));
    this.over.visible = false;
    this.over.onBeforeRender = (renderer, scene, camera) => this.draw(renderer, scene as THREE.Scene, camera as THREE.PerspectiveCamera);
    this.add(this.over);
    void compileCore(new URL('strand_page.wasm', files).href).then((core) => this.begin(core), (error: Error) => this.fail(error.message));
  }
  private begin(core: WebAssembly.Module): void {
    if (this.isDisposed) return;
    this.tell({ kind: 'core', core });
    this.ends.push(
      this.connection.on('asset', (asset) => {
        this.isReady = false;
        this.next = undefined; // of the one before
        this.tell({ kind: 'asset', asset });
      }),
      this.connection.on('look', (look) => {
        this.tell({ kind: 'look', look: look as never });
        this.viewed = '';
      }),
      this.connection.on('state', (state) => {
        this.next = state;
        if (!this.isReady) this.ask({ offset: [0, 0, 1], target: [0, 0, 0], fov: 0.6 }, 640, 360); // nothing is seen yet
      }));
  }
  /** There is something that no picture has shown. */
  get isDirty(): boolean {
    return this.prepared.length > 0 || (this.next !== undefined && !this.isBusy);
  }
  private tell(message: ToPrepare, transfer: Transferable[] = []): void {
    this.worker.postMessage(message, transfer);
  }
  private fail(reason: string): void {
    console.error(`StrandcastHair: ${reason}`);
  }
  private follow({ pose: { position, rotation: [w, x, y, z] } }: State): void {
    this.position.set(...position);
    this.quaternion.set(x, y, z, w);
    this.updateMatrixWorld(true);
  }

  // ---- with the worker: one state or view at a time

  private ask(camera: Camera, width: number, height: number): void {
    if (this.isBusy) return;
    const view = JSON.stringify([camera, width, height]);
    if (!this.next && view === this.viewed) return;
    this.viewed = view;
    if (this.next) {
      const { positions: whole, pose: { rotation }, bust } = (this.asked = this.next);
      const positions = whole.slice(); // what a message copies by itself is copied three times
      this.tell({ kind: 'state', state: { positions, rotation, bust } }, [positions.buffer]);
      this.rotation = rotation;
      this.next = undefined;
      this.isReady = true;
    }
    this.isBusy = true;
    this.tell({ kind: 'view', camera, width, height });
  }
  private hear(message: FromPrepare): void {
    this.isBusy = false;
    if (message.kind === 'failed') return this.fail(message.reason);
    this.prepared.push(message.prepared);
    this.answered = this.asked;
    this.over.visible = true;
  }
  private upload(made: Prepared): void {
    this.state = this.answered;
    const { uniforms } = this;
    const isLine = uniforms.u_is_line.value;
    uniforms.u_frame.value = frameOf(made.block);
    if (made.points) {
      uniforms.u_points.value = this.renewed(uniforms.u_points.value, made.points.data, POINTS_PER_ROW);
      uniforms.u_least_m.value = made.points.least;
      uniforms.u_step_m.value = made.points.step;
    }
    if (made.strandOf) uniforms.u_strand_of.value = this.renewed(uniforms.u_strand_of.value, made.strandOf, POINTS_PER_ROW, 1);
    if (made.strands) uniforms.u_strands.value = this.renewed(uniforms.u_strands.value, made.strands, STRANDS_PER_ROW);
    for (const [i, depth] of (made.depths ?? []).entries()) {
      const uniform = [uniforms.u_key_depth, uniforms.u_rim_depth, uniforms.u_sky_depth][i]!;
      const before = uniform.value as THREE.DataTexture | null;
      if (before?.image.data.length === depth.data.length) {
        before.image.data = depth.data;
        before.needsUpdate = true;
        continue;
      }
      before?.dispose();
      uniform.value = depthOf(depth);
    }
    uniforms.u_order.value = this.renewed(uniforms.u_order.value, made.order, POINTS_PER_ROW, 1);
    if (made.corners) {
      this.strands.geometry.dispose();
      this.strands.geometry = geometryOf(isLine ? made.corners.slice(0, made.corners.length / 3).map((_, i) => i) : made.corners);
    }
    this.strands.geometry.setDrawRange(0, (isLine ? 2 : 6) * made.segmentCount);
    if (made.head && this.skin.visible) {
      this.skin.geometry.dispose();
      const geometry = (this.skin.geometry = geometryOf(made.head.triangles));
      for (const [name, data, width] of [['in_position_m', made.head.positions, 3], ['in_normal', made.head.normals, 3], ['in_cover', made.head.covers, 1]] as const)
        geometry.setAttribute(name, new THREE.BufferAttribute(data, width));
    }
  }
  private renewed(texture: THREE.Texture | null, data: Float32Array, width: number, parts = 4): THREE.Texture {
    const before = texture as THREE.DataTexture | null;
    if (before?.image.data.length === data.length) {
      before.image.data = data;
      before.needsUpdate = true;
      return before;
    }
    before?.dispose();
    return textureOf(data, width, data.length / (parts * width), parts === 4 ? THREE.RGBAFormat : THREE.RedFormat);
  }

  // ---- a picture

  private draw(renderer: THREE.WebGLRenderer, scene: THREE.Scene, camera: THREE.PerspectiveCamera): void {
    const begin = performance.now();
    const into = renderer.getRenderTarget();
    if (into) this.size.set(into.width, into.height);
    else renderer.getDrawingBufferSize(this.size);
    const { x: width, y: height } = this.size;
    this.ask(this.viewOf(camera), width, height);
    for (const made of this.prepared.splice(0)) this.upload(made);
    if (this.options.followsPose && this.state) this.follow(this.state);
    (this.over.material as THREE.RawShaderMaterial).uniforms.u_is_screen!.value = !into;
    if (this.target.width !== width || this.target.height !== height) this.target.setSize(width, height);
    this.look(camera, width, height);

    const { autoClear } = renderer;
    const alpha = renderer.getClearAlpha();
    const color = new THREE.Color().copy(renderer.getClearColor(new THREE.Color())); // some versions return their own
    renderer.setRenderTarget(this.target);
    renderer.setClearColor(new THREE.Color(0), 0);
    renderer.clear();
    renderer.autoClear = false;
    this.drawDepths(renderer, scene, camera);
    renderer.setRenderTarget(into); // three 111 leaves another framebuffer bound than it thinks
    renderer.setRenderTarget(this.target);
    renderer.render(this.own, camera);
    renderer.autoClear = autoClear;
    renderer.setClearColor(color, alpha);
    renderer.setRenderTarget(into);
    this.drawMs = performance.now() - begin;
  }
  /** Of what hides hair: what is opaque. */
  private drawDepths(renderer: THREE.WebGLRenderer, scene: THREE.Scene, camera: THREE.PerspectiveCamera): void {
    const { overrideMaterial, background } = scene;
    const { autoUpdate } = renderer.shadowMap;
    const through: { object: THREE.Object3D; mask: number }[] = [];
    scene.traverse((object) => {
      const { material } = object as THREE.Mesh;
      if (material && [material].flat().every((one) => one.transparent)) through.push({ object, mask: object.layers.mask });
    });
    for (const { object } of through) object.layers.mask = 0;
    renderer.shadowMap.autoUpdate = false;
    this.visible = false;
    Object.assign(scene, { overrideMaterial: this.depthOnly, background: null });
    // A camera of its own: three 111 keeps what it draws by scene and camera, and is drawing by this one.
    this.eye.matrixWorld.copy(camera.matrixWorld);
    this.eye.projectionMatrix.copy(camera.projectionMatrix);
    this.eye.layers.mask = camera.layers.mask;
    renderer.render(scene, this.eye);
    Object.assign(scene, { overrideMaterial, background });
    this.visible = true;
    renderer.shadowMap.autoUpdate = autoUpdate;
    for (const { object, mask } of through) object.layers.mask = mask;
  }
  /** The block's part that follows the camera of this very picture. */
  private look(camera: THREE.PerspectiveCamera, width: number, height: number): void {
    const frame = this.uniforms.u_frame.value!;
    const scale = this.vector.setFromMatrixScale(this.matrixWorld).x;
    this.matrix4.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).multiply(this.matrixWorld);
    frame.clip_from_head!.set(this.matrix4.elements);
    const eye = this.vector.setFromMatrixPosition(camera.matrixWorld).applyMatrix4(this.inverse());
    frame.eye!.set([eye.x, eye.y, eye.z, camera.near]);
    frame.target!.set([width, height, 0.5 * height * camera.projectionMatrix.elements[5]! * scale, camera.far]);
  }
  private inverse(): THREE.Matrix4 {
    const matrix = this.matrix4;
    if (matrix.invert) return matrix.copy(this.matrixWorld).invert!();
    return (matrix as unknown as { getInverse(of: THREE.Matrix4): THREE.Matrix4 }).getInverse(this.matrixWorld);
  }
  /** The camera as the stream's own pages have it: about the head, along the axes of the stream's world. */
  private viewOf(camera: THREE.PerspectiveCamera): Camera {
    const inverse = this.inverse();
    const eye = new THREE.Vector3().setFromMatrixPosition(camera.matrixWorld).applyMatrix4(inverse);
    const ahead = new THREE.Vector3(0, 0, -1).transformDirection(camera.matrixWorld).transformDirection(inverse);
    const distance = Math.max(0.15, -eye.dot(ahead));
    const [w, x, y, z] = this.rotation as [number, number, number, number];
    const turn = new THREE.Quaternion(x, y, z, w);
    const rounded = (v: THREE.Vector3): Vec3 => [v.x, v.y, v.z].map((one) => Math.round(1e5 * one) / 1e5) as Vec3;
    return {
      target: rounded(eye.clone().addScaledVector(ahead, distance).applyQuaternion(turn)),
      offset: rounded(ahead.multiplyScalar(-distance).applyQuaternion(turn)),
      fov: 2 * Math.atan(1 / camera.projectionMatrix.elements[5]!),
    };
  }

  dispose(): void {
    this.isDisposed = true;
    for (const end of this.ends.splice(0)) end();
    this.worker.terminate();
    this.target.dispose();
    for (const { value } of Object.values(this.uniforms)) (value as { dispose?(): void } | null | undefined)?.dispose?.();
    for (const mesh of [this.strands, this.skin, this.over]) {
      mesh.geometry.dispose();
      (mesh.material as THREE.Material).dispose();
    }
    this.depthOnly.dispose();
    this.parent?.remove(this);
  }
}
