// Puts parts of pictures of one height beside each other:
//   node side_by_side.mjs OUT.png PICTURE.png:PART/OF …      PART counts from 0: in.png:1/3 is the middle third

import { readFileSync, writeFileSync } from 'node:fs';
import { PNG } from 'pngjs';

const [ out, ...asked ] = process.argv.slice( 2 );
if ( asked.length === 0 ) {

	console.error( 'usage: node side_by_side.mjs OUT.png PICTURE.png:PART/OF …' );
	process.exit( 2 );

}

const parts = asked.map( ( text ) => {

	const [ , path, part, of ] = /^(.*):(\d+)\/(\d+)$/.exec( text ) ?? [];
	if ( path === undefined ) throw new Error( `${ text } is not PICTURE.png:PART/OF` );
	const picture = PNG.sync.read( readFileSync( path ) ), width = Math.floor( picture.width / Number( of ) );
	return { picture, left: width * Number( part ), width };

} );
const height = Math.min( ...parts.map( ( { picture } ) => picture.height ) );
const whole = new PNG( { width: parts.reduce( ( sum, { width } ) => sum + width, 0 ), height } );
let at = 0;
for ( const { picture, left, width } of parts ) {

	PNG.bitblt( picture, whole, left, 0, width, height, at, 0 );
	at += width;

}

writeFileSync( out, PNG.sync.write( whole ) );
