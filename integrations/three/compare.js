// Frames of two programs side by side: reads them, tells how far they are apart, writes both and their difference. Frames hold radiance as RGBA
// floats, the top row first.

import { readFileSync, writeFileSync } from 'node:fs';
import { deflateSync } from 'node:zlib';
import { FloatType } from 'three';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';

// Below this share of the mean a pixel counts as dark: what is relative to nothing says nothing.
const DARK = 0.02;

export function readExr( path ) {

	const bytes = readFileSync( path );
	const image = new EXRLoader().setDataType( FloatType ).parse( bytes.buffer.slice( bytes.byteOffset, bytes.byteOffset + bytes.length ) );
	const { width, height, data } = image;
	const channels = data.length / ( width * height ), pixels = new Float32Array( 4 * width * height );
	for ( let y = 0; y < height; y ++ ) for ( let x = 0; x < width; x ++ ) for ( let c = 0; c < 3; c ++ )
		pixels[ 4 * ( y * width + x ) + c ] = data[ channels * ( ( height - 1 - y ) * width + x ) + c ];
	return { width, height, pixels };

}

// A portable float map: three channels, little-endian, the bottom row first.
export function readPfm( path ) {

	const bytes = readFileSync( path );
	const header = /^PF\s+(\d+)\s+(\d+)\s+-\S+\s/.exec( bytes.toString( 'latin1', 0, 64 ) );
	if ( header === null ) throw new Error( `${ path } is no portable float map of three little-endian channels` );
	const [ width, height ] = [ Number( header[ 1 ] ), Number( header[ 2 ] ) ], pixels = new Float32Array( 4 * width * height );
	for ( let y = 0; y < height; y ++ ) for ( let x = 0; x < width; x ++ ) for ( let c = 0; c < 3; c ++ )
		pixels[ 4 * ( y * width + x ) + c ] = bytes.readFloatLE( header[ 0 ].length + 4 * ( 3 * ( ( height - 1 - y ) * width + x ) + c ) );
	return { width, height, pixels };

}

// What is lit in the first frame: relative differences of luminance.
export function compare( { width, height, pixels }, other ) {

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

// Both frames, and the difference, four times as bright.
export function writePng( path, { width, height, pixels }, other, exposure ) {

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
