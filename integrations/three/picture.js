// Draws a baked file with three.js in headless Chromium and compares it with Lumbre's frame of the same file, camera and size:
//   node picture.js LEVEL.baked.glb OURS.exr OUT.png [--camera NAME] [--exposure X] [--lightmaps exr|ktx2] [--most ERROR]
// OURS.exr is `lumbre render … --display linear`. OUT.png shows ours, theirs, and the difference, four times as bright. Exits with 1 if
// the median relative difference of what is lit is above ERROR.

import { createReadStream, readFileSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { basename, dirname, extname, resolve, sep } from 'node:path';
import { parseArgs } from 'node:util';
import { deflateSync } from 'node:zlib';
import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';
import { FloatType } from 'three';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';

const HERE = dirname( fileURLToPath( import.meta.url ) );
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.gltf': 'model/gltf+json', '.glb': 'model/gltf-binary' };
// Below this share of the mean a pixel counts as dark: what is relative to nothing says nothing.
const DARK = 0.02;

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

// Linear RGBA, the top row first.
function readExr( path ) {

	const bytes = readFileSync( path );
	const image = new EXRLoader().setDataType( FloatType ).parse( bytes.buffer.slice( bytes.byteOffset, bytes.byteOffset + bytes.length ) );
	const { width, height, data } = image;
	const channels = data.length / ( width * height ), pixels = new Float32Array( 4 * width * height );
	for ( let y = 0; y < height; y ++ ) for ( let x = 0; x < width; x ++ ) for ( let c = 0; c < 3; c ++ )
		pixels[ 4 * ( y * width + x ) + c ] = data[ channels * ( ( height - 1 - y ) * width + x ) + c ];
	return { width, height, pixels };

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

function compare( { width, height, pixels }, other ) {

	const luminance = ( p, at ) => 0.2126 * p[ at ] + 0.7152 * p[ at + 1 ] + 0.0722 * p[ at + 2 ];
	const count = width * height;
	let mean = 0, squares = 0, worst = 0;
	for ( let i = 0; i < count; i ++ ) mean += luminance( pixels, 4 * i ) / count;
	const relative = [];
	for ( let i = 0; i < count; i ++ ) {

		const [ a, b ] = [ luminance( pixels, 4 * i ), luminance( other, 4 * i ) ];
		squares += ( a - b ) ** 2 / count;
		worst = Math.max( worst, Math.abs( a - b ) );
		if ( a > DARK * mean ) relative.push( Math.abs( a - b ) / a );

	}

	relative.sort( ( a, b ) => a - b );
	const at = ( part ) => relative[ Math.floor( part * ( relative.length - 1 ) ) ];
	return { width, height, mean, medianRelative: at( 0.5 ), relative95: at( 0.95 ), rmseOfMean: Math.sqrt( squares ) / mean, largest: worst };

}

function writePng( path, { width, height, pixels }, other, exposure ) {

	const encode = ( value ) => {

		const x = Math.min( Math.max( value * exposure, 0 ), 1 );
		return Math.round( 255 * ( x <= 0.0031308 ? 12.92 * x : 1.055 * x ** ( 1 / 2.4 ) - 0.055 ) );

	};

	const rows = Buffer.alloc( height * ( 1 + 9 * width ) );
	for ( let y = 0; y < height; y ++ ) for ( let x = 0; x < width; x ++ ) for ( let c = 0; c < 3; c ++ ) {

		const [ a, b ] = [ pixels[ 4 * ( y * width + x ) + c ], other[ 4 * ( y * width + x ) + c ] ];
		const row = y * ( 1 + 9 * width ) + 1;
		rows[ row + 3 * x + c ] = encode( a );
		rows[ row + 3 * ( width + x ) + c ] = encode( b );
		rows[ row + 3 * ( 2 * width + x ) + c ] = encode( 4 * Math.abs( a - b ) );

	}

	const chunk = ( type, data ) => {

		const body = Buffer.concat( [ Buffer.from( type ), data ] ), ends = Buffer.alloc( 8 );
		ends.writeUInt32BE( data.length, 0 );
		ends.writeUInt32BE( crc( body ), 4 );
		return Buffer.concat( [ ends.subarray( 0, 4 ), body, ends.subarray( 4 ) ] );

	};

	const header = Buffer.alloc( 13 );
	header.writeUInt32BE( 3 * width, 0 );
	header.writeUInt32BE( height, 4 );
	header.set( [ 8, 2, 0, 0, 0 ], 8 );
	writeFileSync( path, Buffer.concat( [ Buffer.from( [ 137, 80, 78, 71, 13, 10, 26, 10 ] ), chunk( 'IHDR', header ),
		chunk( 'IDAT', deflateSync( rows ) ), chunk( 'IEND', Buffer.alloc( 0 ) ) ] ) );

}

function crc( bytes ) {

	let sum = 0xffffffff;
	for ( const byte of bytes ) {

		sum ^= byte;
		for ( let bit = 0; bit < 8; bit ++ ) sum = sum >>> 1 ^ ( sum & 1 ? 0xedb88320 : 0 );

	}

	return ( sum ^ 0xffffffff ) >>> 0;

}
