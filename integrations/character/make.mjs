// Writes a file as artists have them: a room with lamps, and in it a character with a skeleton, an animation and a normal map, all meshes
// compressed with Draco. Nothing of it is Lumbre's.
//
//   node make.mjs OUT.glb [--plain]      --plain leaves the meshes uncompressed, for programs that cannot read Draco

import { Document, NodeIO } from '@gltf-transform/core';
import { KHRDracoMeshCompression, KHRLightsPunctual } from '@gltf-transform/extensions';
import draco3d from 'draco3dgltf';
import { PNG } from 'pngjs';

const [ out, plain ] = process.argv.slice( 2 );
if ( out === undefined ) {

	console.error( 'usage: node make.mjs OUT.glb [--plain]' );
	process.exit( 2 );

}

const document = new Document();
document.getRoot().getAsset().generator = 'integrations/character/make.mjs';
const buffer = document.createBuffer();
const scene = document.createScene( 'room' );

// Joints stand where they are when nothing moves: [ name, parent, place in the world ].
const JOINTS = [
	[ 'hips', null, [ 0, 0.95, 0 ] ],
	[ 'chest', 'hips', [ 0, 1.25, 0 ] ],
	[ 'head', 'chest', [ 0, 1.55, 0 ] ],
	[ 'left arm', 'chest', [ 0.2, 1.42, 0 ] ],
	[ 'left hand', 'left arm', [ 0.5, 1.42, 0 ] ],
	[ 'right arm', 'chest', [ - 0.2, 1.42, 0 ] ],
	[ 'right hand', 'right arm', [ - 0.5, 1.42, 0 ] ],
	[ 'left leg', 'hips', [ 0.1, 0.85, 0 ] ],
	[ 'left foot', 'left leg', [ 0.1, 0.45, 0 ] ],
	[ 'right leg', 'hips', [ - 0.1, 0.85, 0 ] ],
	[ 'right foot', 'right leg', [ - 0.1, 0.45, 0 ] ],
];
const place = ( name ) => JOINTS.find( ( joint ) => joint[ 0 ] === name )[ 2 ];
const number = ( name ) => JOINTS.findIndex( ( joint ) => joint[ 0 ] === name );

makeRoom();
const character = makeCharacter();
wave( character );
addLamps();
addCamera( [ 1.5, 1.5, 2.6 ], [ 0, 1, 0 ] );

const io = new NodeIO().registerExtensions( [ KHRDracoMeshCompression, KHRLightsPunctual ] )
	.registerDependencies( { 'draco3d.encoder': await draco3d.createEncoderModule() } );
if ( plain !== '--plain' ) document.createExtension( KHRDracoMeshCompression ).setRequired( true )
	.setEncoderOptions( { method: KHRDracoMeshCompression.EncoderMethod.EDGEBREAKER } );
await io.write( out, document );

function accessor( type, array ) {

	return document.createAccessor().setType( type ).setArray( array ).setBuffer( buffer );

}

// A mesh of lists of numbers, the attributes by their names.
function mesh( name, { indices, ...attributes }, material ) {

	const primitive = document.createPrimitive().setMaterial( material ).setIndices( accessor( 'SCALAR', new Uint16Array( indices ) ) );
	for ( const [ semantic, [ type, values, Kind = Float32Array ] ] of Object.entries( attributes ) )
		primitive.setAttribute( semantic, accessor( type, new Kind( values ) ) );
	return document.createMesh( name ).addPrimitive( primitive );

}

// An open box of 4 x 2.8 x 4 metres, seen from within and from its missing side, with a crate.
function makeRoom() {

	const colors = { floor: [ 0.5, 0.38, 0.26 ], ceiling: [ 0.8, 0.8, 0.78 ], 'back wall': [ 0.75, 0.72, 0.65 ], 'left wall': [ 0.6, 0.16, 0.1 ], 'right wall': [ 0.12, 0.3, 0.55 ] };
	const [ w, h, d ] = [ 2, 2.8, 2 ];
	const quads = {
		floor: [ [ [ - w, 0, d ], [ 2 * w, 0, 0 ], [ 0, 0, - 2 * d ] ] ],
		ceiling: [ [ [ - w, h, - d ], [ 2 * w, 0, 0 ], [ 0, 0, 2 * d ] ] ],
		'back wall': [ [ [ - w, 0, - d ], [ 2 * w, 0, 0 ], [ 0, h, 0 ] ] ],
		'left wall': [ [ [ - w, 0, d ], [ 0, 0, - 2 * d ], [ 0, h, 0 ] ] ],
		'right wall': [ [ [ w, 0, - d ], [ 0, 0, 2 * d ], [ 0, h, 0 ] ] ],
		crate: box( [ - 1.1, 0, - 0.9 ], 0.7 ),
	};
	for ( const [ name, list ] of Object.entries( quads ) ) {

		const material = document.createMaterial( name ).setBaseColorFactor( [ ...( colors[ name ] ?? [ 0.55, 0.4, 0.2 ] ), 1 ] ).setMetallicFactor( 0 ).setRoughnessFactor( 1 );
		const [ positions, normals, coordinates, indices ] = [ [], [], [], [] ];
		for ( const [ corner, u, v ] of list ) {

			const first = positions.length / 3;
			const normal = unit( cross( u, v ) );
			for ( const [ s, t ] of [ [ 0, 0 ], [ 1, 0 ], [ 1, 1 ], [ 0, 1 ] ] ) {

				positions.push( ...corner.map( ( x, axis ) => x + s * u[ axis ] + t * v[ axis ] ) );
				normals.push( ...normal );
				coordinates.push( s, 1 - t );

			}

			indices.push( ...[ 0, 1, 2, 0, 2, 3 ].map( ( index ) => first + index ) );

		}

		const made = mesh( name, { POSITION: [ 'VEC3', positions ], NORMAL: [ 'VEC3', normals ], TEXCOORD_0: [ 'VEC2', coordinates ], indices }, material );
		scene.addChild( document.createNode( name ).setMesh( made ) );

	}

}

// The five faces of a crate that one sees.
function box( [ x, y, z ], a ) {

	return [
		[ [ x, y + a, z + a ], [ a, 0, 0 ], [ 0, 0, - a ] ],
		[ [ x, y, z + a ], [ a, 0, 0 ], [ 0, a, 0 ] ], [ [ x + a, y, z ], [ - a, 0, 0 ], [ 0, a, 0 ] ],
		[ [ x + a, y, z + a ], [ 0, 0, - a ], [ 0, a, 0 ] ], [ [ x, y, z ], [ 0, 0, a ], [ 0, a, 0 ] ],
	];

}

// A body of five surfaces of revolution; each ring of vertices hangs on the two joints that it lies between.
function makeCharacter() {

	const parts = [
		// [ from, to, radii along it, joints along it ]
		[ [ 0, 0.8, 0 ], [ 0, 1.82, 0 ], [ 0.16, 0.17, 0.16, 0.17, 0.2, 0.19, 0.1, 0.08, 0.13, 0.13, 0.12 ], [ 'hips', 'chest', 'head' ] ],
		[ [ 0.14, 1.42, 0 ], [ 0.82, 1.42, 0 ], [ 0.08, 0.075, 0.065, 0.06, 0.055, 0.06, 0.07 ], [ 'left arm', 'left hand' ] ],
		[ [ - 0.14, 1.42, 0 ], [ - 0.82, 1.42, 0 ], [ 0.08, 0.075, 0.065, 0.06, 0.055, 0.06, 0.07 ], [ 'right arm', 'right hand' ] ],
		[ [ 0.1, 0.92, 0 ], [ 0.1, 0, 0 ], [ 0.1, 0.1, 0.09, 0.08, 0.07, 0.07, 0.09 ], [ 'left leg', 'left foot' ] ],
		[ [ - 0.1, 0.92, 0 ], [ - 0.1, 0, 0 ], [ 0.1, 0.1, 0.09, 0.08, 0.07, 0.07, 0.09 ], [ 'right leg', 'right foot' ] ],
	];
	const [ positions, normals, coordinates, joints, weights, indices ] = [ [], [], [], [], [], [] ];
	const [ columns, rows ] = [ 20, 28 ];
	for ( const [ from, to, radii, hangsOn ] of parts ) {

		const along = to.map( ( x, axis ) => x - from[ axis ] ), length = Math.hypot( ...along ), axis = along.map( ( x ) => x / length );
		const side = Math.abs( axis[ 1 ] ) > 0.5 ? [ 1, 0, 0 ] : [ 0, 1, 0 ], other = cross( axis, side );
		const first = positions.length / 3;
		for ( let row = 0; row <= rows; row ++ ) {

			// Rings are closer together at the ends, where the surface turns.
			const t = 0.5 - 0.5 * Math.cos( Math.PI * row / rows );
			const radius = rounded( radii, t, length );
			const [ before, after ] = [ Math.max( t - 1e-4, 0 ), Math.min( t + 1e-4, 1 ) ];
			const slope = ( rounded( radii, after, length ) - rounded( radii, before, length ) ) / ( ( after - before ) * length );
			const middle = from.map( ( x, i ) => x + t * along[ i ] );
			const [ pair, share ] = hold( middle, hangsOn );
			for ( let column = 0; column <= columns; column ++ ) {

				const angle = 2 * Math.PI * column / columns, [ c, s ] = [ Math.cos( angle ), Math.sin( angle ) ];
				const outwards = side.map( ( x, i ) => c * x + s * other[ i ] );
				positions.push( ...middle.map( ( x, i ) => x + radius * outwards[ i ] ) );
				const end = row === 0 ? axis.map( ( x ) => - x ) : row === rows ? axis : null;
				normals.push( ...( end ?? unit( outwards.map( ( x, i ) => x - slope * axis[ i ] ) ) ) );
				coordinates.push( 4 * column / columns, 6 * t * length );
				joints.push( number( pair[ 0 ] ), share > 0 ? number( pair[ 1 ] ) : 0, 0, 0 );
				weights.push( 1 - share, share, 0, 0 );

			}

		}

		for ( let row = 0; row < rows; row ++ ) for ( let column = 0; column < columns; column ++ ) {

			const corner = first + row * ( columns + 1 ) + column, above = corner + columns + 1;
			if ( row > 0 ) indices.push( corner, corner + 1, above );
			if ( row + 1 < rows ) indices.push( corner + 1, above + 1, above );

		}

	}

	const bumps = document.createTexture( 'quilted' ).setMimeType( 'image/png' ).setImage( quilted( 128 ) );
	const material = document.createMaterial( 'quilted suit' ).setBaseColorFactor( [ 0.7, 0.55, 0.15, 1 ] ).setMetallicFactor( 0 ).setRoughnessFactor( 0.55 )
		.setNormalTexture( bumps ).setNormalScale( 1 );
	const made = mesh( 'character', {
		POSITION: [ 'VEC3', positions ], NORMAL: [ 'VEC3', normals ], TEXCOORD_0: [ 'VEC2', coordinates ],
		JOINTS_0: [ 'VEC4', joints, Uint8Array ], WEIGHTS_0: [ 'VEC4', weights ], indices,
	}, material );
	const skin = document.createSkin( 'skeleton' );
	const nodes = JOINTS.map( ( [ name, parent, at ] ) => {

		const base = parent === null ? [ 0, 0, 0 ] : place( parent );
		return document.createNode( name ).setTranslation( at.map( ( x, axis ) => x - base[ axis ] ) );

	} );
	JOINTS.forEach( ( [ , parent ], index ) => ( parent === null ? scene : nodes[ number( parent ) ] ).addChild( nodes[ index ] ) );
	nodes.forEach( ( node ) => skin.addJoint( node ) );
	const bind = JOINTS.flatMap( ( [ , , [ x, y, z ] ] ) => [ 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, - x, - y, - z, 1 ] );
	skin.setInverseBindMatrices( accessor( 'MAT4', new Float32Array( bind ) ) ).setSkeleton( nodes[ 0 ] );
	scene.addChild( document.createNode( 'character' ).setMesh( made ).setSkin( skin ) );
	return nodes;

}

// A curve through equally spaced values, which ends in half balls.
function rounded( values, t, length ) {

	const end = length * Math.min( t, 1 - t ), radius = t < 0.5 ? values[ 0 ] : values.at( - 1 );
	return smooth( values, t ) * Math.sqrt( 1 - Math.max( 0, 1 - end / radius ) ** 2 );

}

// A curve through equally spaced values.
function smooth( values, t ) {

	const at = Math.min( t * ( values.length - 1 ), values.length - 1 - 1e-9 ), i = Math.floor( at ), x = at - i;
	const value = ( index ) => values[ Math.min( Math.max( index, 0 ), values.length - 1 ) ];
	const [ a, b, c, d ] = [ value( i - 1 ), value( i ), value( i + 1 ), value( i + 2 ) ];
	return Math.max( 0, b + 0.5 * x * ( c - a + x * ( 2 * a - 5 * b + 4 * c - d + x * ( 3 * ( b - c ) + d - a ) ) ) );

}

// The two joints between which a ring lies, and the share of the second.
function hold( middle, names ) {

	const distance = ( name ) => Math.hypot( ...place( name ).map( ( x, axis ) => x - middle[ axis ] ) );
	const [ a, b ] = [ ...names ].sort( ( p, q ) => distance( p ) - distance( q ) );
	const [ p, q ] = [ distance( a ), distance( b ) ];
	const share = Math.max( 0, ( 1 - 2 * p / ( p + q ) ) );
	return [ [ a, b ], 0.5 * ( 1 - Math.min( 1, 2 * share ) ) ];

}

// Tangent-space normals of cushions with seams between them.
function quilted( side ) {

	const png = new PNG( { width: side, height: side } );
	for ( let y = 0; y < side; y ++ ) for ( let x = 0; x < side; x ++ ) {

		const [ u, v ] = [ x, y ].map( ( at ) => ( at + 0.5 ) / side );
		// Heights are |sin πu · sin πv|^½ of a cushion as wide as the picture; green points up, against v.
		const slope = ( p, q ) => 0.5 * Math.PI * Math.cos( Math.PI * p ) * Math.sqrt( Math.sin( Math.PI * q ) / Math.max( Math.sin( Math.PI * p ), 0.02 ) );
		const normal = unit( [ - 0.12 * slope( u, v ), 0.12 * slope( v, u ), 1 ] );
		png.data.set( [ ...normal.map( ( n ) => Math.round( 127.5 * ( n + 1 ) ) ), 255 ], 4 * ( y * side + x ) );

	}

	return PNG.sync.write( png );

}

function wave( joints ) {

	const animation = document.createAnimation( 'wave' );
	const turn = ( degrees ) => [ 0, 0, Math.sin( degrees * Math.PI / 360 ), Math.cos( degrees * Math.PI / 360 ) ];
	for ( const [ name, times, angles ] of [
		[ 'right arm', [ 0, 0.5, 1.5, 2 ], [ 0, - 60, - 60, 0 ] ],
		[ 'right hand', [ 0, 0.5, 0.75, 1, 1.25, 1.5, 2 ], [ 0, - 20, - 60, - 20, - 60, - 20, 0 ] ],
		[ 'left arm', [ 0, 0.5, 1.5, 2 ], [ 0, - 50, - 50, 0 ] ],
	] ) {

		const sampler = document.createAnimationSampler().setInterpolation( 'LINEAR' )
			.setInput( accessor( 'SCALAR', new Float32Array( times ) ) ).setOutput( accessor( 'VEC4', new Float32Array( angles.flatMap( turn ) ) ) );
		animation.addSampler( sampler ).addChannel( document.createAnimationChannel().setTargetNode( joints[ number( name ) ] ).setTargetPath( 'rotation' ).setSampler( sampler ) );

	}

}

function addLamps() {

	const lights = document.createExtension( KHRLightsPunctual );
	for ( const [ name, at, color, intensity ] of [ [ 'ceiling lamp', [ 0.9, 2.4, 0.9 ], [ 1, 0.85, 0.65 ], 6 ], [ 'corner lamp', [ - 1.4, 1.9, 0.8 ], [ 0.6, 0.75, 1 ], 2.5 ] ] ) {

		const light = lights.createLight( name ).setType( 'point' ).setColor( color ).setIntensity( intensity );
		scene.addChild( document.createNode( name ).setTranslation( at ).setExtension( 'KHR_lights_punctual', light ) );

	}

}

function addCamera( at, towards ) {

	const back = unit( at.map( ( x, axis ) => x - towards[ axis ] ) ), right = unit( cross( [ 0, 1, 0 ], back ) ), up = cross( back, right );
	const w = Math.sqrt( Math.max( 0, 1 + right[ 0 ] + up[ 1 ] + back[ 2 ] ) ) / 2;
	const turn = [ ( up[ 2 ] - back[ 1 ] ) / ( 4 * w ), ( back[ 0 ] - right[ 2 ] ) / ( 4 * w ), ( right[ 1 ] - up[ 0 ] ) / ( 4 * w ), w ];
	const camera = document.createCamera( 'view' ).setType( 'perspective' ).setYFov( 0.85 ).setZNear( 0.05 ).setZFar( 100 ).setAspectRatio( 4 / 3 );
	scene.addChild( document.createNode( 'view' ).setTranslation( at ).setRotation( turn ).setCamera( camera ) );

}

function cross( a, b ) {

	return [ a[ 1 ] * b[ 2 ] - a[ 2 ] * b[ 1 ], a[ 2 ] * b[ 0 ] - a[ 0 ] * b[ 2 ], a[ 0 ] * b[ 1 ] - a[ 1 ] * b[ 0 ] ];

}

function unit( v ) {

	const length = Math.hypot( ...v );
	return v.map( ( x ) => x / length );

}
