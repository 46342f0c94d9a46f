// Makes the files of this folder: npm install gltfpack@1.3 meshoptimizer@1.3 @gltf-transform/core@4.5 @gltf-transform/extensions@4.5
// @gltf-transform/functions@4.5 draco3dgltf@1.5 ktx2-encoder@0.6 sharp, in a folder whose path is the first argument.
import { createRequire } from 'node:module';
import { execFileSync } from 'node:child_process';
import { rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const packages = process.argv[2];
const require = createRequire(join(packages, 'package.json'));
const load = async (name) => import(require.resolve(name));
const { MeshoptEncoder, MeshoptDecoder } = await load('meshoptimizer');
await MeshoptEncoder.ready;
await MeshoptDecoder.ready;

// A generator of numbers that is the same everywhere (Park and Miller).
let seed = 1;
const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;

// FNV-1a of 64 bits.
const fnv = (bytes) => bytes.reduce((h, b) => ((h ^ BigInt(b)) * 0x100000001b3n) & 0xffffffffffffffffn, 0xcbf29ce484222325n).toString(16);

// --- streams.json: streams of meshopt with what the reference decoder makes of them.
const streams = [];
function stream(mode, filter, stride, count, version, source) {
    const bytes = MeshoptEncoder.encodeGltfBuffer(source, count, stride, mode, version);
    const decoded = new Uint8Array(count * stride);
    MeshoptDecoder.decodeGltfBuffer(decoded, count, stride, bytes, mode, filter);
    const base64 = (b) => Buffer.from(b).toString('base64');
    const plain = filter === 'NONE' || filter === 'EXPONENTIAL';
    if (filter === 'NONE' && mode !== 'TRIANGLES' && Buffer.compare(Buffer.from(decoded), Buffer.from(source))) throw mode + ' is not the same again';
    streams.push({
        mode, filter, byteStride: stride, count, bytes: base64(bytes),
        ...(plain ? { fnv: fnv(decoded) } : { decoded: base64(decoded) }),
    });
}
const bytesOf = (typed) => new Uint8Array(typed.buffer, typed.byteOffset, typed.byteLength);
// Smooth, rough and constant bytes, in numbers of elements about the sizes of groups and blocks.
for (const version of [0, 1])
    for (const [stride, count] of [[4, 1], [4, 16], [4, 257], [8, 15], [12, 33], [16, 300], [36, 70], [256, 20]]) {
        const source = new Uint8Array(stride * count);
        for (let i = 0; i < count; i++)
            for (let b = 0; b < stride; b++) {
                const kind = (b + (i >> 6)) % 6;
                source[i * stride + b] = [7, 3 * i, i % 5 ? 9 : 30, 200 + 2 * random(), 256 * random(), i >> 3][kind];
            }
        stream('ATTRIBUTES', 'NONE', stride, count, version, source);
    }
// Numbers of 16 and 32 bits, for the channels of version 1.
const waves = new Uint16Array(4 * 200), floats = new Float32Array(3 * 200);
for (let i = 0; i < 200; i++) {
    for (let c = 0; c < 4; c++) waves[4 * i + c] = 30000 + 20000 * Math.sin(0.02 * i * (c + 1));
    for (let c = 0; c < 3; c++) floats[3 * i + c] = Math.fround(Math.cos(0.05 * i * (c + 1)));
}
stream('ATTRIBUTES', 'NONE', 8, 200, 1, bytesOf(waves));
stream('ATTRIBUTES', 'NONE', 12, 200, 1, bytesOf(floats));
// A grid of triangles, in order and shuffled, then with gaps that no FIFO holds.
const grid = [];
for (let y = 0; y < 8; y++)
    for (let x = 0; x < 12; x++) {
        const at = y * 13 + x;
        grid.push([at, at + 1, at + 13], [at + 1, at + 14, at + 13]);
    }
const shuffled = grid.map((t) => [random(), t]).sort((a, b) => a[0] - b[0]).map(([, t]) => t);
for (const triangles of [grid, shuffled, shuffled.map((t) => t.map((i) => (i * 7919) % 60000)), grid.concat(grid)])
    for (const type of [Uint16Array, Uint32Array]) {
        const list = type.from(triangles.flat());
        stream('TRIANGLES', 'NONE', list.BYTES_PER_ELEMENT, list.length, undefined, bytesOf(list));
        stream('INDICES', 'NONE', list.BYTES_PER_ELEMENT, list.length, undefined, bytesOf(list));
    }
stream('INDICES', 'NONE', 4, 5, undefined, bytesOf(Uint32Array.from([0, 1 << 29, 3, (1 << 29) - 1, 0])));
const unit = (n) => { const v = Array.from({ length: n }, () => random() - 0.5); const l = Math.hypot(...v); return v.map((x) => x / l); };
const vectors = (n, make) => Float32Array.from(Array.from({ length: n }, make).flat());
const normals = vectors(60, () => [...unit(3), 1]), turns = vectors(60, () => unit(4)), colors = vectors(60, () => [random(), random(), random(), random()]);
for (const [stride, bits] of [[4, 8], [4, 5], [8, 16], [8, 10]]) {
    stream('ATTRIBUTES', 'OCTAHEDRAL', stride, 60, 0, MeshoptEncoder.encodeFilterOct(normals, 60, stride, bits));
    stream('ATTRIBUTES', 'COLOR', stride, 60, 1, MeshoptEncoder.encodeFilterColor(colors, 60, stride, bits));
}
for (const bits of [16, 12, 6]) stream('ATTRIBUTES', 'QUATERNION', 8, 60, 0, MeshoptEncoder.encodeFilterQuat(turns, 60, 8, bits));
for (const bits of [24, 15, 3]) stream('ATTRIBUTES', 'EXPONENTIAL', 12, 200, 1, MeshoptEncoder.encodeFilterExp(floats.map((f) => f * 1e-3), 200, 12, bits));
writeFileSync('streams.json', '[\n' + streams.map((s) => JSON.stringify(s)).join(',\n') + '\n]\n');

// --- knot.glb: a tube along a torus knot with normals, uvs, colours and a texture, at three nodes, one of which turns.
const { NodeIO, Document } = await load('@gltf-transform/core');
const extensions = await load('@gltf-transform/extensions');
const sharp = (await load('sharp')).default;
function knot(texture, still) {
    const document = new Document();
    const buffer = document.createBuffer();
    const accessor = (type, array) => document.createAccessor().setType(type).setArray(array).setBuffer(buffer);
    const [rings, sides] = [72, 10];
    const path = (t) => { const r = 2 + Math.cos(3 * t); return [r * Math.cos(2 * t), r * Math.sin(2 * t), -Math.sin(3 * t)]; };
    const positions = [], directions = [], uvs = [], tints = [], indices = [];
    for (let i = 0; i <= rings; i++) {
        const t = (2 * Math.PI * i) / rings;
        const [a, b, c] = [path(t - 1e-4), path(t), path(t + 1e-4)];
        const ahead = c.map((x, k) => x - a[k]);
        const out = [b[0], b[1], 0];
        const cross = (u, v) => [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        const unit = (v) => v.map((x) => x / Math.hypot(...v));
        const side = unit(cross(ahead, out)), up = unit(cross(side, ahead));
        for (let j = 0; j <= sides; j++) {
            const angle = (2 * Math.PI * j) / sides;
            const n = side.map((x, k) => x * Math.cos(angle) + up[k] * Math.sin(angle));
            positions.push(...b.map((x, k) => x + 0.45 * n[k]));
            directions.push(...n);
            uvs.push((6 * i) / rings, j / sides);
            tints.push(0.6 + 0.4 * Math.cos(t), 0.6 + 0.4 * Math.cos(t + 2), 0.6 + 0.4 * Math.cos(t + 4), 1);
            if (i < rings && j < sides) {
                const at = i * (sides + 1) + j;
                indices.push(at, at + 1, at + sides + 1, at + 1, at + sides + 2, at + sides + 1);
            }
        }
    }
    const image = document.createTexture('checks').setImage(texture).setMimeType('image/png');
    const material = document.createMaterial('painted').setBaseColorTexture(image).setMetallicFactor(0).setRoughnessFactor(0.7);
    const primitive = document.createPrimitive().setMaterial(material).setIndices(accessor('SCALAR', Uint16Array.from(indices)))
        .setAttribute('POSITION', accessor('VEC3', Float32Array.from(positions)))
        .setAttribute('NORMAL', accessor('VEC3', Float32Array.from(directions)))
        .setAttribute('TEXCOORD_0', accessor('VEC2', Float32Array.from(uvs)))
        .setAttribute('COLOR_0', accessor('VEC4', Float32Array.from(tints)));
    const mesh = document.createMesh('knot').addPrimitive(primitive);
    const scene = document.createScene();
    const nodes = [[-4, 0, 0], [4, 0, 0], [0, 0, -5]].map((place, i) =>
        document.createNode('knot ' + i).setMesh(mesh).setTranslation(place).setScale([1, 1, 1].map((s) => s * (1 - 0.2 * i))));
    nodes.forEach((node) => scene.addChild(node));
    if (still) return document;
    const turn = (a) => [0, Math.sin(a / 2), 0, Math.cos(a / 2)];
    const sampler = document.createAnimationSampler().setInput(accessor('SCALAR', Float32Array.from([0, 1, 2])))
        .setOutput(accessor('VEC4', Float32Array.from([0, 1, 2].flatMap(turn))));
    document.createAnimation('turning').addSampler(sampler).addChannel(document.createAnimationChannel()
        .setTargetNode(nodes[0]).setTargetPath('rotation').setSampler(sampler));
    return document;
}
const texels = Buffer.alloc(64 * 64 * 3);
for (let i = 0; i < 64 * 64; i++) {
    const [x, y] = [i % 64, i >> 6], check = (x >> 3) + (y >> 3) & 1;
    texels.set(check ? [230, 90 + 2 * x, 40] : [30, 60, 100 + 2 * y], 3 * i);
}
const raw = sharp(texels, { raw: { width: 64, height: 64, channels: 3 } });
const png = await raw.png({ palette: false }).toBuffer();
const io = new NodeIO().registerExtensions(extensions.ALL_EXTENSIONS);
const plain = knot(png);
await io.write('knot.glb', plain);
const gltfpack = (out, from, ...flags) =>
    execFileSync('node', [join(packages, 'node_modules/gltfpack/cli.js'), '-i', from, '-o', out, '-km', ...flags]);
gltfpack('knot-meshopt-ext.glb', 'knot.glb', '-kn', '-cc', '-ce', 'ext');
gltfpack('knot-meshopt-khr.glb', 'knot.glb', '-kn', '-cz', '-ce', 'khr', '-vpf', '-vn', '10');
gltfpack('knot-quantized.glb', 'knot.glb', '-kn');
// gltfpack merges only what stands still into instances.
await io.write('still.glb', knot(png, true));
gltfpack('knot-instanced.glb', 'still.glb', '-mi', '-cc');
rmSync('still.glb');

// --- the same by Draco, with both kinds of connectivity; the slowest settings predict by valence.
const draco = { 'draco3d.encoder': await (await load('draco3dgltf')).default.createEncoderModule() };
const quantizationBits = { POSITION: 14, NORMAL: 10, COLOR: 8, TEX_COORD: 12, GENERIC: 12 };
for (const [name, method, speed] of [['edgebreaker', 'edgebreaker', 5], ['valence', 'edgebreaker', 0], ['sequential', 'sequential', 10]]) {
    const document = await io.read('knot.glb');
    document.createExtension(extensions.KHRDracoMeshCompression).setRequired(true)
        .setEncoderOptions({ method, encodeSpeed: speed, decodeSpeed: speed, quantizationBits, quantizationVolume: 'mesh' });
    await io.registerDependencies(draco).write(`knot-draco-${name}.glb`, document);
}

// --- fading.*: an image with alpha whose size is no multiple of four, as PNG, as WebP, and in KTX 2.
const { encodeToKTX2 } = await import(pathToFileURL(join(packages, 'node_modules/ktx2-encoder/dist/node/index.js')));
const imageDecoder = async (bytes) => {
    const { data, info } = await sharp(bytes).ensureAlpha().raw().toBuffer({ resolveWithObject: true });
    return { data: new Uint8Array(data), width: info.width, height: info.height };
};
const encode = (image, options) => encodeToKTX2(image, { imageDecoder, isPerceptual: true, isSetKTX2SRGBTransferFunc: true, generateMipmap: true, ...options });
const modes = {
    etc1s: { isUASTC: false, qualityLevel: 255 },
    uastc: { isUASTC: true, needSupercompression: false },
    'uastc-zstd': { isUASTC: true, needSupercompression: true },
};
const [width, height] = [30, 18], fading = Buffer.alloc(width * height * 4);
for (let i = 0; i < width * height; i++) fading.set([8 * (i % width), 14 * Math.floor(i / width), 90, 255 - 8 * (i % width)], 4 * i);
const faded = await sharp(fading, { raw: { width, height, channels: 4 } }).png().toBuffer();
writeFileSync('fading.png', faded);
writeFileSync('fading.webp', await sharp(faded).webp({ lossless: true, exact: true }).toBuffer());
for (const [name, options] of Object.entries(modes)) writeFileSync(`fading-${name}.ktx2`, await encode(faded, options));
