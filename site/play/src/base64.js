// @ts-check
// Contents of a file in base64.
/** @param {Blob} file @returns {Promise<string>} */
export function base64(file) {
  return new Promise((resolve, reject) => {
    const reader = new FileReader();
    reader.onload = () => resolve(String(reader.result).replace(/^[^,]*,/, ''));
    reader.onerror = () => reject(new Error('it could not be read'));
    reader.readAsDataURL(file);
  });
}
