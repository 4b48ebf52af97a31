// Fonts are there, pictures are decoded (also those that would wait to be scrolled to), and a frame is drawn.
(async () => {
  await document.fonts.ready;
  for (const image of document.images) image.loading = 'eager';
  await Promise.allSettled([...document.querySelectorAll('img, image')].map(image => image.decode()));
  await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
})()
