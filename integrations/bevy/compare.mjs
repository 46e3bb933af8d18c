// Compares Bevy's frame with Lumbre's of the same file, camera and size:
//   node compare.mjs OURS.exr BEVY.pfm OUT.png [--most ERROR]
// OUT.png shows ours, Bevy's, and the difference, four times as bright. Exits with 1 if the median relative difference of what is lit is above ERROR.

import { parseArgs } from 'node:util';
import { compare, readExr, readPfm, writePng } from '../three/compare.js';

const { values: asked, positionals: [ oursAt, theirsAt, out ] } = parseArgs( { allowPositionals: true, options: { most: { type: 'string' } } } );
if ( ! out ) {

	console.error( 'usage: node compare.mjs OURS.exr BEVY.pfm OUT.png [--most ERROR]' );
	process.exit( 2 );

}

const [ ours, theirs ] = [ readExr( oursAt ), readPfm( theirsAt ) ];
if ( ours.width !== theirs.width || ours.height !== theirs.height )
	throw new Error( `${ oursAt } has ${ ours.width } x ${ ours.height } pixels, ${ theirsAt } ${ theirs.width } x ${ theirs.height }` );
const figures = compare( ours, theirs.pixels );
console.log( JSON.stringify( figures ) );
writePng( out, ours, theirs.pixels, 1 );
if ( asked.most !== undefined && ! ( figures.medianRelative <= Number( asked.most ) ) ) {

	console.error( `the frames differ by more than ${ asked.most }` );
	process.exit( 1 );

}
