// Writes a small level to compare by: an open box with a red and a green wall, a lamp panel and two blocks. Its surfaces are matt to the last:
// what a frame shows of them is the lightmap times the base colour, in every renderer.

import { writeFileSync } from 'node:fs';

const GREY = [ 0.7, 0.7, 0.7 ], RED = [ 0.6, 0.1, 0.08 ], GREEN = [ 0.12, 0.45, 0.1 ];
const json = {
	asset: { version: '2.0', generator: 'integrations/three/box.js' },
	scene: 0, scenes: [ { nodes: [] } ], nodes: [], meshes: [], materials: [], accessors: [], bufferViews: [], buffers: [],
	extensionsUsed: [ 'KHR_materials_specular', 'KHR_materials_emissive_strength' ],
	cameras: [ { type: 'perspective', name: 'front', perspective: { yfov: 0.7, znear: 0.05, aspectRatio: 1 } } ],
};

function add( values, type, componentType, target ) {

	const typed = componentType === 5126 ? new Float32Array( values.flat() ) : new Uint16Array( values );
	const bytes = Buffer.from( typed.buffer );
	const byteOffset = json.buffers.reduce( ( sum, part ) => sum + part.length, 0 );
	json.buffers.push( Buffer.concat( [ bytes, Buffer.alloc( ( 4 - bytes.length % 4 ) % 4 ) ] ) );
	json.bufferViews.push( { buffer: 0, byteOffset, byteLength: bytes.length, target } );
	const accessor = { bufferView: json.bufferViews.length - 1, componentType, type, count: values.length };
	if ( type === 'VEC3' ) [ accessor.min, accessor.max ] = [ Math.min, Math.max ].map( ( pick ) => [ 0, 1, 2 ].map( ( axis ) =>
		pick( ...typed.filter( ( _, at ) => at % 3 === axis ) ) ) );
	json.accessors.push( accessor );
	return json.accessors.length - 1;

}

// A mesh of quads; each is a corner and two sides, and faces along their cross product.
function mesh( name, quads, material ) {

	const at = [], facing = [], order = [];
	for ( const [ corner, u, v ] of quads ) {

		const cross = [ u[ 1 ] * v[ 2 ] - u[ 2 ] * v[ 1 ], u[ 2 ] * v[ 0 ] - u[ 0 ] * v[ 2 ], u[ 0 ] * v[ 1 ] - u[ 1 ] * v[ 0 ] ];
		const normal = cross.map( ( x ) => x / Math.hypot( ...cross ) );
		order.push( ...[ 0, 1, 2, 0, 2, 3 ].map( ( index ) => index + at.length ) );
		for ( const [ s, t ] of [ [ 0, 0 ], [ 1, 0 ], [ 1, 1 ], [ 0, 1 ] ] ) {

			at.push( corner.map( ( x, axis ) => x + s * u[ axis ] + t * v[ axis ] ) );
			facing.push( normal );

		}

	}

	const attributes = { POSITION: add( at, 'VEC3', 5126, 34962 ), NORMAL: add( facing, 'VEC3', 5126, 34962 ) };
	json.materials.push( { name, ...material } );
	json.meshes.push( { name, primitives: [ { attributes, indices: add( order, 'SCALAR', 5123, 34963 ), material: json.materials.length - 1 } ] } );
	json.nodes.push( { name, mesh: json.meshes.length - 1 } );
	json.scenes[ 0 ].nodes.push( json.nodes.length - 1 );

}

function matt( color ) {

	return { pbrMetallicRoughness: { baseColorFactor: [ ...color, 1 ], metallicFactor: 0, roughnessFactor: 1 },
		extensions: { KHR_materials_specular: { specularFactor: 0 } } };

}

// The faces of a box without its bottom, turned about +Y.
function block( [ x, z ], [ width, height, depth ], angle ) {

	const turn = ( [ a, b, c ] ) => [ a * Math.cos( angle ) + c * Math.sin( angle ), b, - a * Math.sin( angle ) + c * Math.cos( angle ) ];
	const [ w, h, d ] = [ width, height, depth ];
	const corner = ( p ) => turn( p ).map( ( value, axis ) => value + [ x, - 1, z ][ axis ] );
	return [
		[ [ - w / 2, h, d / 2 ], [ w, 0, 0 ], [ 0, 0, - d ] ],
		[ [ - w / 2, 0, d / 2 ], [ w, 0, 0 ], [ 0, h, 0 ] ], [ [ w / 2, 0, - d / 2 ], [ - w, 0, 0 ], [ 0, h, 0 ] ],
		[ [ w / 2, 0, d / 2 ], [ 0, 0, - d ], [ 0, h, 0 ] ], [ [ - w / 2, 0, - d / 2 ], [ 0, 0, d ], [ 0, h, 0 ] ],
	].map( ( [ at, u, v ] ) => [ corner( at ), turn( u ), turn( v ) ] );

}

mesh( 'floor', [ [ [ - 1, - 1, 1 ], [ 2, 0, 0 ], [ 0, 0, - 2 ] ] ], matt( GREY ) );
mesh( 'ceiling', [ [ [ - 1, 1, - 1 ], [ 2, 0, 0 ], [ 0, 0, 2 ] ] ], matt( GREY ) );
mesh( 'back wall', [ [ [ - 1, - 1, - 1 ], [ 2, 0, 0 ], [ 0, 2, 0 ] ] ], matt( GREY ) );
mesh( 'left wall', [ [ [ - 1, - 1, 1 ], [ 0, 0, - 2 ], [ 0, 2, 0 ] ] ], matt( RED ) );
mesh( 'right wall', [ [ [ 1, - 1, - 1 ], [ 0, 0, 2 ], [ 0, 2, 0 ] ] ], matt( GREEN ) );
mesh( 'low block', block( [ 0.35, 0.3 ], [ 0.6, 0.6, 0.6 ], - 0.3 ), matt( GREY ) );
mesh( 'high block', block( [ - 0.35, - 0.3 ], [ 0.6, 1.2, 0.6 ], 0.3 ), matt( GREY ) );
mesh( 'lamp', [ [ [ - 0.3, 0.98, - 0.3 ], [ 0.6, 0, 0 ], [ 0, 0, 0.6 ] ] ], { ...matt( [ 0, 0, 0 ] ), emissiveFactor: [ 1, 0.85, 0.6 ],
	extensions: { KHR_materials_specular: { specularFactor: 0 }, KHR_materials_emissive_strength: { emissiveStrength: 12 } } } );
json.nodes.push( { name: 'front', camera: 0, translation: [ 0, 0, 3.9 ] } );
json.scenes[ 0 ].nodes.push( json.nodes.length - 1 );
const whole = Buffer.concat( json.buffers );
json.buffers = [ { byteLength: whole.length, uri: `data:application/octet-stream;base64,${ whole.toString( 'base64' ) }` } ];
writeFileSync( process.argv[ 2 ], JSON.stringify( json ) );
