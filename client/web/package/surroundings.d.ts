// Of Node and browsers what the package uses: the compiler's own declarations do not have it.
declare module 'node:fs/promises' {
  export function readFile(file: URL): Promise<Uint8Array>;
}
declare module 'three' {
  export const RGBAFormat: number, RedFormat: number, FloatType: number, HalfFloatType: number, NearestFilter: number, LinearFilter: number;
  export const CustomBlending: number, NoBlending: number, OneFactor: number, OneMinusSrcAlphaFactor: number, DoubleSide: number;
  export class Color {
    constructor(hex?: number);
    copy(from: Color): this;
  }
  export class Vector2 {
    x: number;
    y: number;
    set(x: number, y: number): this;
  }
  export class Vector3 {
    constructor(x?: number, y?: number, z?: number);
    x: number;
    y: number;
    z: number;
    set(x: number, y: number, z: number): this;
    clone(): Vector3;
    dot(other: Vector3): number;
    setFromMatrixScale(matrix: Matrix4): this;
    setFromMatrixPosition(matrix: Matrix4): this;
    applyMatrix4(matrix: Matrix4): this;
    applyQuaternion(turn: Quaternion): this;
    transformDirection(matrix: Matrix4): this;
    addScaledVector(other: Vector3, by: number): this;
    multiplyScalar(by: number): this;
  }
  export class Quaternion {
    constructor(x: number, y: number, z: number, w: number);
    set(x: number, y: number, z: number, w: number): this;
  }
  export class Matrix4 {
    readonly elements: ArrayLike<number>;
    copy(from: Matrix4): this;
    invert?(): this;
    multiply(other: Matrix4): this;
    multiplyMatrices(a: Matrix4, b: Matrix4): this;
  }
  export class Object3D {
    readonly position: Vector3;
    readonly quaternion: Quaternion;
    readonly matrixWorld: Matrix4;
    parent: Object3D | null;
    visible: boolean;
    frustumCulled: boolean;
    readonly layers: { mask: number };
    traverse(look: (object: Object3D) => void): void;
    updateMatrixWorld(isForced: boolean): void;
    onBeforeRender: (renderer: WebGLRenderer, scene: Object3D, camera: Object3D) => void;
    add(...objects: Object3D[]): this;
    remove(...objects: Object3D[]): this;
  }
  export class Scene extends Object3D {
    overrideMaterial: Material | null;
    background: unknown;
  }
  export class PerspectiveCamera extends Object3D {
    near: number;
    far: number;
    readonly projectionMatrix: Matrix4;
    readonly matrixWorldInverse: Matrix4;
  }
  export class Mesh extends Object3D {
    constructor(geometry: BufferGeometry, material: Material);
    geometry: BufferGeometry;
    material: Material;
  }
  export class LineSegments extends Mesh {}
  export class BufferAttribute {
    constructor(array: ArrayLike<number>, width: number);
    readonly array: ArrayLike<number>;
    needsUpdate: boolean;
  }
  export class BufferGeometry {
    index: BufferAttribute | null;
    setAttribute(name: string, attribute: BufferAttribute): this;
    setIndex(index: BufferAttribute): this;
    setDrawRange(first: number, count: number): void;
    dispose(): void;
  }
  export class Material {
    transparent: boolean;
    dispose(): void;
  }
  export class MeshBasicMaterial extends Material {
    constructor(options: object);
  }
  export class RawShaderMaterial extends Material {
    constructor(options: object);
    readonly uniforms: { [name: string]: { value: unknown } };
  }
  export class Texture {
    needsUpdate: boolean;
    generateMipmaps: boolean;
    dispose(): void;
  }
  export class DataTexture extends Texture {
    constructor(data: ArrayBufferView, width: number, height: number, format: number, type: number);
    readonly image: { data: ArrayBufferView & { readonly length: number } };
  }
  export class DataTexture3D extends Texture {
    constructor(data: ArrayBufferView, width: number, height: number, depth: number);
  }
  export class WebGLRenderTarget {
    constructor(width: number, height: number, options: object);
    readonly width: number;
    readonly height: number;
    readonly texture: Texture;
    setSize(width: number, height: number): void;
    dispose(): void;
  }
  export class WebGLRenderer {
    autoClear: boolean;
    readonly shadowMap: { autoUpdate: boolean };
    getRenderTarget(): WebGLRenderTarget | null;
    setRenderTarget(target: WebGLRenderTarget | null): void;
    getDrawingBufferSize(into: Vector2): Vector2;
    getClearColor(into: Color): Color;
    getClearAlpha(): number;
    setClearColor(color: Color, alpha: number): void;
    clear(): void;
    render(scene: Object3D, camera: Object3D): void;
  }
}
