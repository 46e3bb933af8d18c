// Draws a baked file with three.js in headless Chromium and compares it with Lumbre's frame of the same file, camera and size:
//   node picture.js LEVEL.baked.glb OURS.exr OUT.png [--camera NAME] [--exposure X] [--lightmaps exr|ktx2] [--most ERROR]
// OURS.exr is `lumbre render … --display linear`. OUT.png shows ours, theirs, and the difference, four times as bright. Exits with 1 if
// the median relative difference of what is lit is above ERROR.

import { createReadStream } from 'node:fs';
import { createServer } from 'node:http';
import { basename, dirname, extname, resolve, sep } from 'node:path';
import { parseArgs } from 'node:util';
import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';
import { compare, readExr, writePng } from './compare.js';

const HERE = dirname( fileURLToPath( import.meta.url ) );
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.gltf': 'model/gltf+json', '.glb': 'model/gltf-binary', '.wasm': 'application/wasm' };

const { values: asked, positionals } = parseArgs( { allowPositionals: true, options: {
	camera: { type: 'string' }, exposure: { type: 'string', default: '1' }, lightmaps: { type: 'string', default: 'exr' }, most: { type: 'string' },
} } );
const [ level, oursAt, out ] = positionals;
if ( ! out ) {

	console.error( 'usage: node picture.js LEVEL.baked.glb OURS.exr OUT.png [--camera NAME] [--exposure X] [--lightmaps exr|ktx2] [--most ERROR]' );
	process.exit( 2 );

}

const ours = readExr( oursAt );
const theirs = await draw( ours );
const figures = compare( ours, theirs.pixels );
figures.lightmapped = theirs.lightmapped;
console.log( JSON.stringify( figures ) );
writePng( out, ours, theirs.pixels, Number( asked.exposure ) );
if ( theirs.lightmapped === 0 || asked.most !== undefined && ! ( figures.medianRelative <= Number( asked.most ) ) ) {

	console.error( theirs.lightmapped === 0 ? `${ level }: no mesh has a lightmap` : `the pictures differ by more than ${ asked.most }` );
	process.exit( 1 );

}

async function draw( { width, height } ) {

	const folder = dirname( resolve( level ) );
	const server = createServer( ( request, response ) => {

		const path = decodeURIComponent( new URL( request.url, 'http://localhost' ).pathname );
		const [ root, name ] = path.startsWith( '/level/' ) ? [ folder, path.slice( 7 ) ] : [ HERE, path.slice( 1 ) ];
		const file = resolve( root, name );
		if ( ! file.startsWith( root + sep ) ) return response.writeHead( 404 ).end();
		response.setHeader( 'content-type', TYPES[ extname( file ) ] ?? 'application/octet-stream' );
		createReadStream( file ).on( 'error', () => response.writeHead( 404 ).end() ).pipe( response );

	} );
	await new Promise( ( done ) => server.listen( 0, '127.0.0.1', done ) );
	const browser = await chromium.launch( { executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', args: [ '--headless', '--no-sandbox',
		'--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-background-networking' ] } );

	try {

		const page = await browser.newPage( { viewport: { width: 320, height: 180 } } );
		page.on( 'console', ( message ) => { if ( [ 'error', 'warning' ].includes( message.type() ) ) console.error( `page: ${ message.text() }` ); } );
		const query = new URLSearchParams( { file: `level/${ encodeURIComponent( basename( level ) ) }`, lightmaps: asked.lightmaps } );
		if ( asked.camera ) query.set( 'camera', asked.camera );
		await page.goto( `http://127.0.0.1:${ server.address().port }/index.html?${ query }` );
		await page.waitForFunction( () => window.frame || window.failed, null, { timeout: 300_000 } );
		const failed = await page.evaluate( () => window.failed );
		if ( failed ) throw new Error( failed );
		const pixels = Float32Array.from( await page.evaluate( ( [ w, h ] ) => window.frame( w, h ), [ width, height ] ) );
		return { pixels, lightmapped: await page.evaluate( () => window.lightmapped ) };

	} finally {

		await browser.close();
		server.close();

	}

}
