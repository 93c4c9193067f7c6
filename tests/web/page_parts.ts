// What tests/web/page.test.mjs looks at.
export * from '../../client/web/page/address';
export * from '../../client/web/page/clock';
export * from '../../client/web/page/fields';
export { shaderText } from '../../client/web/page/gl/shader_text';
export * from '../../client/web/page/jpeg_tiles';
export { lookNumbers } from '../../client/web/page/picture';
export * from '../../client/web/page/reconnect';
export * from '../../client/web/page/scene_text';
export { rgbaOfTile } from '../../client/web/page/tile_planes';
export { orbit, pan, zoom } from '../../client/web/page/ui/orbit';
export { Net } from '../../client/web/page/session';
export * from '../../client/web/page/wire';
export * from '../../client/web/page/socket';
export { Tape } from '../../client/web/page/tape';
