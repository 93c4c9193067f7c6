// Programs of WebGL2, with the compiler's words where one does not compile.
import { shaderText } from './shader_text';

function compile(gl: WebGL2RenderingContext, type: number, text: string): WebGLShader {
  const shader = gl.createShader(type)!;
  gl.shaderSource(shader, shaderText(text));
  gl.compileShader(shader);
  return shader;
}

export class Program {
  readonly program: WebGLProgram;
  private readonly places = new Map<string, WebGLUniformLocation | null>();
  constructor(private readonly gl: WebGL2RenderingContext, vertex: string, fragment: string, captured: string[] = []) {
    const program = (this.program = gl.createProgram()!);
    const shaders = [compile(gl, gl.VERTEX_SHADER, vertex), compile(gl, gl.FRAGMENT_SHADER, fragment)];
    for (const shader of shaders) gl.attachShader(program, shader);
    if (captured.length) gl.transformFeedbackVaryings(program, captured, gl.INTERLEAVED_ATTRIBS);
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
      const logs = [gl.getProgramInfoLog(program), ...shaders.map((shader) => gl.getShaderInfoLog(shader))];
      throw new Error(`a shader does not compile here: ${logs.filter(Boolean).join(' ')}`);
    }
    for (const shader of shaders) gl.deleteShader(shader);
    const block = gl.getUniformBlockIndex(program, 'TileFrameBlock');
    if (block !== gl.INVALID_INDEX) gl.uniformBlockBinding(program, block, 0);
    gl.useProgram(program);
  }
  at(name: string): WebGLUniformLocation | null {
    if (!this.places.has(name)) this.places.set(name, this.gl.getUniformLocation(this.program, name));
    return this.places.get(name)!;
  }
  use(): void {
    this.gl.useProgram(this.program);
  }
}
