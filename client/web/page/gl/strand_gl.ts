// Strands by WebGL2: points are shaded once each by transform feedback, then drawn as triangles in the order that the
// core found, from back to front, over the head; all in linear light, then tone curve and sRGB.
import type { PictureParts, StrandPicture } from '../picture';
import headFrag from 'client/web/page/gl/head.frag.glsl';
import headVert from 'client/web/page/gl/head.vert.glsl';
import nothingFrag from 'client/web/page/gl/nothing.frag.glsl';
import pointsVert from 'client/web/page/gl/points.vert.glsl';
import { Program } from './program';
import resolveFrag from 'client/web/page/gl/resolve.frag.glsl';
import resolveVert from 'client/web/page/gl/resolve.vert.glsl';
import strandFrag from 'client/web/page/gl/strand.frag.glsl';
import strandVert from 'client/web/page/gl/strand.vert.glsl';

const STRANDS_PER_ROW = 1024;
const CORNER_BYTES = 48;
const CAPTURED = ['v_place_0', 'v_light_0', 'v_line_0', 'v_place_1', 'v_light_1', 'v_line_1'];

/** A buffer that grows. */
class Grown {
  readonly buffer: WebGLBuffer;
  private size = 0;
  constructor(private readonly gl: WebGL2RenderingContext, private readonly target: number) {
    this.buffer = gl.createBuffer()!;
  }
  reserve(bytes: number): void {
    this.gl.bindBuffer(this.target, this.buffer);
    if (bytes <= this.size) return;
    this.size = Math.ceil(bytes * 1.25);
    this.gl.bufferData(this.target, this.size, this.gl.DYNAMIC_DRAW);
  }
  fill(data: ArrayBufferView): void {
    this.reserve(data.byteLength);
    this.gl.bufferSubData(this.target, 0, data);
  }
}

export class StrandGl {
  private readonly points: Program;
  private readonly strands: Program;
  private readonly head: Program;
  private readonly resolve: Program;
  private readonly frame: WebGLBuffer;
  private readonly places: Grown;
  private readonly strandOf: Grown;
  private readonly corners: Grown;
  private readonly order: Grown;
  private readonly feedback: WebGLTransformFeedback;
  private readonly pointsArray: WebGLVertexArrayObject;
  private readonly strandsArray: WebGLVertexArrayObject;
  private readonly headArray: WebGLVertexArrayObject;
  private readonly emptyArray: WebGLVertexArrayObject;
  private headIndices = 0;
  private readonly depths: WebGLTexture[];
  private readonly strandTexture: WebGLTexture;
  private layoutNumber = -1;
  private lightNumber = -1;
  private headNumber = -1;
  private skin: WebGLBuffer[] = []; // positions and normals of the head
  private target?: { width: number; height: number; head: WebGLFramebuffer; scene: WebGLFramebuffer; texture: WebGLTexture; free: () => void };

  /** Throws where this browser's WebGL2 cannot. `samples`: of a pixel, for the head's edges. */
  constructor(private readonly gl: WebGL2RenderingContext, private readonly samples: number) {
    if (!gl.getExtension('EXT_color_buffer_float') && !gl.getExtension('EXT_color_buffer_half_float'))
      throw new Error('WebGL2 here cannot draw into half floats');
    this.points = new Program(gl, pointsVert, nothingFrag, CAPTURED);
    this.strands = new Program(gl, strandVert, strandFrag);
    this.head = new Program(gl, headVert, headFrag);
    this.resolve = new Program(gl, resolveVert, resolveFrag);
    this.frame = gl.createBuffer()!;
    this.places = new Grown(gl, gl.ARRAY_BUFFER);
    this.strandOf = new Grown(gl, gl.ARRAY_BUFFER);
    this.corners = new Grown(gl, gl.ARRAY_BUFFER);
    this.order = new Grown(gl, gl.ELEMENT_ARRAY_BUFFER);
    this.feedback = gl.createTransformFeedback()!;
    this.pointsArray = gl.createVertexArray()!;
    this.strandsArray = gl.createVertexArray()!;
    this.headArray = gl.createVertexArray()!;
    this.emptyArray = gl.createVertexArray()!;
    this.depths = [0, 1, 2].map((unit) => this.makeTexture(unit, gl.TEXTURE_3D, gl.LINEAR));
    this.strandTexture = this.makeTexture(3, gl.TEXTURE_2D, gl.NEAREST);
    for (const program of [this.points, this.head]) {
      program.use();
      gl.uniform1i(program.at('u_key_depth'), 0);
      gl.uniform1i(program.at('u_rim_depth'), 1);
      gl.uniform1i(program.at('u_sky_depth'), 2);
      gl.uniform1i(program.at('u_strands'), 3);
    }
    this.resolve.use();
    gl.uniform1i(this.resolve.at('u_scene'), 4);
  }

  private makeTexture(unit: number, target: number, filter: number): WebGLTexture {
    const gl = this.gl;
    const texture = gl.createTexture()!;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(target, texture);
    gl.texParameteri(target, gl.TEXTURE_MIN_FILTER, filter);
    gl.texParameteri(target, gl.TEXTURE_MAG_FILTER, filter);
    for (const axis of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R]) gl.texParameteri(target, axis, gl.CLAMP_TO_EDGE);
    return texture;
  }

  setHead(picture: StrandPicture): void {
    const gl = this.gl;
    const head = picture.head();
    gl.bindVertexArray(this.headArray);
    const attribute = (place: number, size: number, data: Float32Array): void => {
      const buffer = gl.createBuffer()!;
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      this.skin[place] = buffer;
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 0, 0);
    };
    attribute(0, 3, head.positions);
    attribute(1, 3, head.normals);
    attribute(2, 1, head.covers);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, head.triangles, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    this.headIndices = head.triangles.length;
    this.layoutNumber = this.lightNumber = this.headNumber = -1;
  }

  private resize(width: number, height: number): void {
    if (this.target && this.target.width === width && this.target.height === height) return;
    this.target?.free();
    const gl = this.gl;
    const buffers: WebGLRenderbuffer[] = [];
    const attach = (place: number, format: number, samples: number): void => {
      const buffer = gl.createRenderbuffer()!;
      buffers.push(buffer);
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorageMultisample(gl.RENDERBUFFER, samples, format, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, buffer);
    };
    const check = (): void => {
      const status = gl.checkFramebufferStatus(gl.FRAMEBUFFER);
      if (status !== gl.FRAMEBUFFER_COMPLETE) throw new Error(`WebGL2 here cannot draw into half floats (${status})`);
    };
    const scene = gl.createFramebuffer()!;
    const texture = this.makeTexture(4, gl.TEXTURE_2D, gl.NEAREST);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA16F, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, scene);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    attach(gl.DEPTH_ATTACHMENT, gl.DEPTH_COMPONENT24, 0);
    check();
    const head = gl.createFramebuffer()!;
    gl.bindFramebuffer(gl.FRAMEBUFFER, head);
    attach(gl.COLOR_ATTACHMENT0, gl.RGBA16F, this.samples);
    attach(gl.DEPTH_ATTACHMENT, gl.DEPTH_COMPONENT24, this.samples);
    check();
    const free = (): void => {
      gl.deleteTexture(texture);
      for (const buffer of buffers) gl.deleteRenderbuffer(buffer);
      gl.deleteFramebuffer(head);
      gl.deleteFramebuffer(scene);
    };
    this.target = { width, height, head, scene, texture, free };
  }

  private upload(picture: StrandPicture, parts: PictureParts): void {
    const gl = this.gl;
    gl.bindBuffer(gl.UNIFORM_BUFFER, this.frame);
    gl.bufferData(gl.UNIFORM_BUFFER, picture.bytes(parts.block, parts.blockBytes), gl.DYNAMIC_DRAW);
    gl.bindBufferBase(gl.UNIFORM_BUFFER, 0, this.frame);
    if (this.headNumber !== parts.headNumber && this.headIndices) {
      this.headNumber = parts.headNumber;
      const head = picture.head();
      for (const [place, data] of [head.positions, head.normals].entries()) {
        gl.bindBuffer(gl.ARRAY_BUFFER, this.skin[place]!);
        gl.bufferSubData(gl.ARRAY_BUFFER, 0, data);
      }
    }
    // Element arrays are part of the array that is bound.
    gl.bindVertexArray(this.strandsArray);
    this.order.fill(picture.uints(parts.corners, parts.cornerCount));
    if (this.lightNumber !== parts.lightNumber) {
      this.lightNumber = parts.lightNumber;
      gl.bindVertexArray(null);
      this.places.fill(picture.floats(parts.points, 3 * (parts.pointCount + 2)));
      const [x, y, z] = parts.latticeSize;
      const [hx, hy, hz] = parts.halfSize;
      const halves = hx * hy * hz;
      const store = (unit: number, size: readonly [number, number, number], at: number): void => {
        gl.activeTexture(gl.TEXTURE0 + unit);
        gl.bindTexture(gl.TEXTURE_3D, this.depths[unit]!);
        gl.pixelStorei(gl.UNPACK_ALIGNMENT, 2);
        gl.texImage3D(gl.TEXTURE_3D, 0, gl.R16F, ...size, 0, gl.RED, gl.HALF_FLOAT, picture.shorts(at, size[0] * size[1] * size[2]));
      };
      store(0, [x, y, z], parts.keyDepth);
      store(1, [hx, hy, hz], parts.otherDepth);
      store(2, [hx, hy, hz], parts.otherDepth + 2 * halves);
    }
    if (this.layoutNumber === parts.layoutNumber) return;
    this.layoutNumber = parts.layoutNumber;
    this.strandOf.fill(picture.uints(parts.strandOf, parts.pointCount));
    const rows = Math.max(1, Math.ceil(parts.strandCount / STRANDS_PER_ROW));
    const numbers = new Uint32Array(4 * STRANDS_PER_ROW * rows);
    numbers.set(picture.uints(parts.strands, 4 * parts.strandCount));
    gl.activeTexture(gl.TEXTURE3);
    gl.bindTexture(gl.TEXTURE_2D, this.strandTexture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32UI, STRANDS_PER_ROW, rows, 0, gl.RGBA_INTEGER, gl.UNSIGNED_INT, numbers);
    gl.bindVertexArray(this.pointsArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.places.buffer);
    for (const place of [0, 1, 2]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 12, 12 * place);
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, this.strandOf.buffer);
    gl.enableVertexAttribArray(3);
    gl.vertexAttribIPointer(3, 1, gl.UNSIGNED_INT, 4, 0);
    this.corners.reserve(2 * CORNER_BYTES * parts.pointCount);
    gl.bindVertexArray(this.strandsArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.corners.buffer);
    for (const place of [0, 1, 2]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 4, gl.FLOAT, false, CORNER_BYTES, 16 * place);
    }
    gl.bindVertexArray(null);
  }

  /** Where colours are masked its depths alone. */
  private drawHead(into: WebGLFramebuffer): void {
    const gl = this.gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, into);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!this.headIndices) return;
    this.head.use();
    gl.bindVertexArray(this.headArray);
    gl.drawElements(gl.TRIANGLES, this.headIndices, gl.UNSIGNED_INT, 0);
  }

  draw(picture: StrandPicture, parts: PictureParts, size: { width: number; height: number }, background: readonly number[]): void {
    const gl = this.gl;
    this.upload(picture, parts);
    this.resize(size.width, size.height);
    const target = this.target!;
    this.depths.forEach((texture, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_3D, texture);
    });
    gl.activeTexture(gl.TEXTURE3);
    gl.bindTexture(gl.TEXTURE_2D, this.strandTexture);
    gl.activeTexture(gl.TEXTURE4);
    gl.bindTexture(gl.TEXTURE_2D, null);

    this.points.use();
    gl.bindVertexArray(this.pointsArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, null);
    gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, this.feedback);
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, this.corners.buffer);
    gl.enable(gl.RASTERIZER_DISCARD);
    gl.beginTransformFeedback(gl.POINTS);
    gl.drawArrays(gl.POINTS, 0, parts.pointCount);
    gl.endTransformFeedback();
    gl.disable(gl.RASTERIZER_DISCARD);
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, null);
    gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, null);

    // Strands have smooth edges by themselves: only the head is drawn in samples.
    gl.viewport(0, 0, size.width, size.height);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LESS);
    gl.clearColor(0, 0, 0, 0);
    gl.clearDepth(1);
    this.drawHead(target.head);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, target.head);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, target.scene);
    gl.blitFramebuffer(0, 0, size.width, size.height, 0, 0, size.width, size.height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    gl.colorMask(false, false, false, false);
    this.drawHead(target.scene);
    gl.colorMask(true, true, true, true);
    this.strands.use();
    gl.bindVertexArray(this.strandsArray);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    gl.drawElements(gl.TRIANGLES, parts.cornerCount, gl.UNSIGNED_INT, 0);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    gl.disable(gl.DEPTH_TEST);

    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, size.width, size.height);
    this.resolve.use();
    gl.activeTexture(gl.TEXTURE4);
    gl.bindTexture(gl.TEXTURE_2D, target.texture);
    gl.uniform1f(this.resolve.at('u_height_px'), size.height);
    gl.uniform3f(this.resolve.at('u_background'), background[0]!, background[1]!, background[2]!);
    gl.bindVertexArray(this.emptyArray);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindVertexArray(null);
  }
}
