// Opens a report's page from its file and looks for faults: `node check.mjs FOLDER`. Pictures go to FOLDER/screenshots.

import { mkdir } from 'node:fs/promises';
import { resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { chromium } from 'playwright-core';

const folder = resolve( process.argv[ 2 ] ?? '.' );
const pictures = resolve( folder, 'screenshots' );
await mkdir( pictures, { recursive: true } );
const faults = [];

const browser = await chromium.launch( { executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', args: [ '--headless', '--no-sandbox' ] } );

for ( const width of [ 390, 1400 ] ) {

	for ( const colorScheme of [ 'light', 'dark' ] ) {

		const name = `${ width }-${ colorScheme }`;
		const page = await browser.newPage( { viewport: { width, height: 900 }, colorScheme } );
		page.on( 'console', ( message ) => { if ( message.type() === 'error' ) faults.push( `${ name }: console: ${ message.text() }` ); } );
		page.on( 'pageerror', ( error ) => faults.push( `${ name }: ${ error }` ) );
		page.on( 'request', ( request ) => { if ( ! /^(file|data):/.test( request.url() ) ) faults.push( `${ name }: asks for ${ request.url() }` ); } );
		await page.goto( pathToFileURL( resolve( folder, 'index.html' ) ).href );
		faults.push( ...( await page.evaluate( tooWide ) ).map( ( fault ) => `${ name }: ${ fault }` ) );
		faults.push( ...( await page.evaluate( overlappingText ) ).map( ( fault ) => `${ name }: ${ fault }` ) );
		await page.screenshot( { path: `${ pictures }/${ name }.png`, fullPage: true } );
		for ( const section of await page.locator( 'section' ).all() ) {

			const file = `${ pictures }/${ name }-${ await section.getAttribute( 'id' ) }`;
			await section.screenshot( { path: `${ file }.png` } );
			await section.locator( '.plots' ).screenshot( { path: `${ file }-plots.png` } );

		}


		for ( const section of await page.locator( 'section' ).all() ) faults.push( ...( await pointAt( section ) ).map( ( fault ) => `${ name }: ${ fault }` ) );
		for ( const viewer of await page.locator( '.viewer' ).all() ) faults.push( ...( await clickThrough( viewer ) ).map( ( fault ) => `${ name }: ${ fault }` ) );

		await page.close();

	}

}

// On paper.
const printed = await browser.newPage();
await printed.goto( pathToFileURL( resolve( folder, 'index.html' ) ).href );
await printed.pdf( { path: `${ pictures }/printed.pdf`, format: 'A4', margin: { top: '15mm', bottom: '15mm', left: '15mm', right: '15mm' } } );
await browser.close();

for ( const fault of faults ) console.error( fault );
console.log( `${ pictures }: ${ faults.length } faults` );
process.exitCode = faults.length === 0 ? 0 : 1;

/** What reaches beyond the window, other than what scrolls by itself. */
function tooWide() {

	const width = document.documentElement.clientWidth;
	if ( document.documentElement.scrollWidth <= width ) return [];
	const scrolls = ( element ) => element.closest( '.scroll' ) !== null;
	const wide = [ ...document.querySelectorAll( 'body *' ) ].filter( ( element ) => ! scrolls( element ) && element.getBoundingClientRect().right > width + 1 );
	return [ `the page is ${ document.documentElement.scrollWidth } wide: ${ wide.slice( 0, 5 ).map( ( element ) => element.tagName + '.' + element.className ).join( ', ' ) }` ];

}

/** Texts of a plot that lie over each other, or reach out of it. */
function overlappingText() {

	const found = [];
	for ( const svg of document.querySelectorAll( '.plot svg' ) ) {

		if ( svg.getBoundingClientRect().width === 0 ) continue;
		const frame = svg.getBoundingClientRect();
		const title = svg.closest( 'figure' ).querySelector( 'figcaption' ).textContent;
		const texts = [ ...svg.querySelectorAll( 'text' ) ].map( ( text ) => ( { words: text.textContent.trim(), box: text.getBoundingClientRect() } ) );
		for ( const [ place, { words, box } ] of texts.entries() ) {

			if ( box.left < frame.left - 1 || box.right > frame.right + 1 || box.top < frame.top - 1 || box.bottom > frame.bottom + 1 ) found.push( `${ title }: "${ words }" reaches out of the plot` );
			for ( const other of texts.slice( place + 1 ) ) {

				const across = Math.min( box.right, other.box.right ) - Math.max( box.left, other.box.left );
				const down = Math.min( box.bottom, other.box.bottom ) - Math.max( box.top, other.box.top );
				if ( across > 1 && down > 4 ) found.push( `${ title }: "${ words }" lies over "${ other.words }"` );

			}

		}

	}

	return found;

}

/** Points at a plot's points, and chooses one: each says what it is within the figure, and the chosen one shows its picture. */
async function pointAt( section ) {

	const found = [], id = await section.getAttribute( 'id' );
	for ( const figure of await section.locator( '.plot' ).all() ) {

		const title = await figure.locator( 'figcaption' ).textContent();
		const hits = figure.locator( '.hit' ).filter( { visible: true } );
		const count = await hits.count();
		if ( count === 0 ) found.push( `${ id }, ${ title }: no point answers` );
		for ( const place of new Set( [ 0, count - 1 ] ) ) {

			if ( place < 0 ) continue;
			const hit = hits.nth( place ), tip = figure.locator( '.tip' );
			// Others may lie over it: the keyboard reaches each.
			await hit.focus();
			const says = await tip.locator( 'p' ).textContent(), means = await hit.getAttribute( 'data-details' );
			if ( ! await tip.isVisible() || says !== means ) found.push( `${ id }, ${ title }: a point says "${ says }" in place of "${ means }"` );
			const reaches = await tip.evaluate( ( tip ) => tip.getBoundingClientRect().right - document.documentElement.clientWidth );
			if ( reaches > 1 ) found.push( `${ id }, ${ title }: what a point says reaches out of the window by ${ reaches }` );
			const button = section.locator( `.gallery button[data-point="${ await hit.getAttribute( 'data-point' ) }"]` );
			if ( await button.count() === 0 ) continue;
			await hit.press( 'Enter' );
			const shown = await section.locator( '.pair .picture' ).getAttribute( 'src' );
			if ( shown !== await button.locator( 'img' ).getAttribute( 'src' ) ) found.push( `${ id }, ${ title }: a chosen point does not show its picture` );

		}

		await figure.evaluate( () => document.activeElement.blur() );
		if ( await figure.locator( '.tip' ).isVisible() ) found.push( `${ id }, ${ title }: what a point said stays` );

	}

	return found;

}

/** Chooses the last picture of a viewer, its heat map, and moves the slider. */
async function clickThrough( viewer ) {

	const picture = viewer.locator( '.pair .picture' ), other = viewer.locator( '.pair .other' );
	const buttons = viewer.locator( 'button' ), last = buttons.last();
	await last.click();
	const found = [];
	if ( await picture.getAttribute( 'src' ) !== await last.locator( 'img' ).getAttribute( 'src' ) ) found.push( 'a click on a picture does not show it' );
	await viewer.locator( 'input[value=heat]' ).check();
	if ( await other.getAttribute( 'src' ) !== await last.getAttribute( 'data-heat' ) ) found.push( 'the heat map is not shown' );
	await viewer.locator( 'input[value=reference]' ).check();
	await viewer.locator( 'input[type=range]' ).fill( '20' );
	const at = await viewer.locator( '.pair' ).evaluate( ( pair ) => pair.style.getPropertyValue( '--at' ) );
	if ( at !== '20%' ) found.push( 'the slider does not move the border' );
	return found;

}
