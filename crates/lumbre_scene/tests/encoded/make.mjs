// Makes the encoded files of this folder with the reference encoders, and beside each what the reference decoder finds in it: NAME.json for a
// Draco mesh, NAME.rgba for a picture of 22 x 17 texels, top row first.
//   npm ci && node make.mjs
import { readFileSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import draco3d from 'draco3dgltf';
import { encodeToKTX2 } from 'ktx2-encoder';
import sharp from 'sharp';

const require = createRequire(import.meta.url);

// A tube of six columns and four rows: its seam has the same positions with other texture coordinates.
function tube() {
  const [columns, rows] = [6, 4];
  const mesh = { POSITION: [], NORMAL: [], TEXCOORD_0: [], COLOR_0: [], JOINTS_0: [], _HEAT: [], indices: [] };
  for (let row = 0; row < rows; row++) {
    for (let column = 0; column <= columns; column++) {
      const angle = (column % columns) / columns * 2 * Math.PI;
      const radius = 1 + 0.25 * Math.sin(3 * row + column % columns);
      mesh.POSITION.push(radius * Math.cos(angle), row * 0.5, radius * Math.sin(angle));
      mesh.NORMAL.push(Math.cos(angle), 0, Math.sin(angle));
      mesh.TEXCOORD_0.push(column / columns, row / (rows - 1));
      mesh.COLOR_0.push(40 * row, 30 * column, 255 - 50 * row, 255);
      mesh.JOINTS_0.push(row, column, 300 + row, 0);
      mesh._HEAT.push(row + column / 8);
    }
  }
  for (let row = 0; row + 1 < rows; row++) {
    for (let column = 0; column < columns; column++) {
      const corner = row * (columns + 1) + column;
      const above = corner + columns + 1;
      mesh.indices.push(corner, above, corner + 1, corner + 1, above, above + 1);
    }
  }
  return mesh;
}

function encodeDraco(encoderModule, mesh, method, speed) {
  const encoder = new encoderModule.Encoder();
  const builder = new encoderModule.MeshBuilder();
  const made = new encoderModule.Mesh();
  const points = mesh.POSITION.length / 3;
  builder.AddFacesToMesh(made, mesh.indices.length / 3, new Uint32Array(mesh.indices));
  const ids = {
    POSITION: builder.AddFloatAttribute(made, encoderModule.POSITION, points, 3, new Float32Array(mesh.POSITION)),
    NORMAL: builder.AddFloatAttribute(made, encoderModule.NORMAL, points, 3, new Float32Array(mesh.NORMAL)),
    TEXCOORD_0: builder.AddFloatAttribute(made, encoderModule.TEX_COORD, points, 2, new Float32Array(mesh.TEXCOORD_0)),
    COLOR_0: builder.AddUInt8Attribute(made, encoderModule.COLOR, points, 4, new Uint8Array(mesh.COLOR_0)),
    JOINTS_0: builder.AddUInt16Attribute(made, encoderModule.GENERIC, points, 4, new Uint16Array(mesh.JOINTS_0)),
    _HEAT: builder.AddFloatAttribute(made, encoderModule.GENERIC, points, 1, new Float32Array(mesh._HEAT)),
  };
  encoder.SetSpeedOptions(speed, speed);
  encoder.SetEncodingMethod(method);
  encoder.SetAttributeQuantization(encoderModule.POSITION, 11);
  encoder.SetAttributeQuantization(encoderModule.NORMAL, 8);
  encoder.SetAttributeQuantization(encoderModule.TEX_COORD, 10);
  const output = new encoderModule.DracoInt8Array();
  const length = encoder.EncodeMeshToDracoBuffer(made, output);
  const bytes = new Uint8Array(length);
  for (let at = 0; at < length; at++) bytes[at] = output.GetValue(at);
  return { bytes, ids };
}

function decodeDraco(module, bytes, ids) {
  const decoder = new module.Decoder();
  const mesh = new module.Mesh();
  const status = decoder.DecodeArrayToMesh(bytes, bytes.length, mesh);
  if (!status.ok()) throw new Error(status.error_msg());
  const faces = [];
  const face = new module.DracoInt32Array();
  for (let at = 0; at < mesh.num_faces(); at++) {
    decoder.GetFaceFromMesh(mesh, at, face);
    faces.push(face.GetValue(0), face.GetValue(1), face.GetValue(2));
  }
  const attributes = {};
  for (const [name, id] of Object.entries(ids)) {
    const attribute = decoder.GetAttributeByUniqueId(mesh, id);
    const values = new module.DracoFloat32Array();
    decoder.GetAttributeFloatForAllPoints(mesh, attribute, values);
    // Integers are scaled by this call only if they are normalized, which these are not.
    attributes[name] = Array.from({ length: values.size() }, (_, at) => values.GetValue(at));
  }
  return { ids, points: mesh.num_points(), indices: faces, attributes };
}

// A picture with an edge, a slope and a hole. Its sides are no multiple of four.
function picture(alpha) {
  const [width, height] = [22, 17];
  const data = new Uint8Array(4 * width * height);
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const wall = x > 9 ? 255 : 60;
      data.set([wall, 12 * y, 11 * x, alpha && x > 14 ? 15 * y : 255], 4 * (y * width + x));
    }
  }
  return { width, height, data };
}

async function decodeBasis(bytes) {
  const folder = new URL('.', 'file://' + require.resolve('three/examples/jsm/libs/basis/basis_transcoder.js'));
  const module = {};
  const factory = new Function('module', 'exports', 'require', '__dirname',
    readFileSync(new URL('basis_transcoder.js', folder), 'utf8') + '\nreturn BASIS;')(module, {}, require, folder.pathname);
  const basis = await factory({ wasmBinary: readFileSync(new URL('basis_transcoder.wasm', folder)) });
  basis.initializeBasis();
  const file = new basis.KTX2File(new Uint8Array(bytes));
  if (!file.isValid() || !file.startTranscoding()) throw new Error('the reference transcoder refuses the file');
  const rgba32 = 13;
  const size = file.getImageTranscodedSizeInBytes(0, 0, 0, rgba32);
  const data = new Uint8Array(size);
  if (!file.transcodeImage(data, 0, 0, 0, rgba32, 0, -1, -1)) throw new Error('the reference transcoder fails');
  return data;
}

function keep(name, bytes, rgba) {
  writeFileSync(name, bytes);
  writeFileSync(`${name}.rgba`, rgba);
  console.log(name, bytes.length, 'bytes');
}

const encoderModule = await draco3d.createEncoderModule({});
const decoderModule = await draco3d.createDecoderModule({});
for (const [name, method, speed] of [
  ['edgebreaker.drc', encoderModule.MESH_EDGEBREAKER_ENCODING, 5],
  ['edgebreaker_valence.drc', encoderModule.MESH_EDGEBREAKER_ENCODING, 0],
  ['sequential.drc', encoderModule.MESH_SEQUENTIAL_ENCODING, 7],
]) {
  const { bytes, ids } = encodeDraco(encoderModule, tube(), method, speed);
  writeFileSync(name, bytes);
  const decoded = decodeDraco(decoderModule, bytes, ids);
  writeFileSync(`${name}.json`, JSON.stringify(decoded) + '\n');
  console.log(name, bytes.length, 'bytes,', decoded.points, 'points');
}

for (const [name, alpha, options] of [
  ['uastc.ktx2', true, { isUASTC: true, needSupercompression: false }],
  ['uastc_zstandard.ktx2', false, { isUASTC: true, needSupercompression: true }],
  ['etc1s.ktx2', false, { isUASTC: false, qualityLevel: 128 }],
  ['etc1s_alpha.ktx2', true, { isUASTC: false, qualityLevel: 128, generateMipmap: true }],
]) {
  const image = picture(alpha);
  const bytes = await encodeToKTX2(image.data, { generateMipmap: false, isSetKTX2SRGBTransferFunc: true, ...options, imageDecoder: async () => image });
  keep(name, bytes, await decodeBasis(bytes));
}

for (const [name, alpha, options] of [
  ['lossy.webp', false, { quality: 80 }],
  ['lossy_alpha.webp', true, { quality: 80 }],
  ['lossless.webp', true, { lossless: true }],
]) {
  const { width, height, data } = picture(alpha);
  const bytes = await sharp(data, { raw: { width, height, channels: 4 } }).webp(options).toBuffer();
  const decoded = await sharp(bytes).ensureAlpha().raw().toBuffer();
  keep(name, bytes, decoded);
}
