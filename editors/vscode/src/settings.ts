// Settings for the server, and the commands that it runs. Uses no types of the editor, so that tests can import it.

export interface Options {
  inlayHints: { units: boolean; values: boolean; types: boolean };
  pictures: 'data' | 'file' | 'none';
  codeLens: boolean;
}

/** The settings of the section `shibo` as the server takes them. */
export function options(get: <T>(key: string, fallback: T) => T): Options {
  return {
    inlayHints: {
      units: get('inlayHints.units', true),
      values: get('inlayHints.values', true),
      types: get('inlayHints.types', true),
    },
    pictures: get('pictures', 'data'),
    codeLens: get('codeLens', true),
  };
}

/** Commands of the server. */
export const SERVER = { render: 'shibo.render', preview: 'shibo.preview', show: 'shibo.show', follow: 'shibo.follow', unfollow: 'shibo.unfollow' } as const;
/** Commands of this extension. */
export const OWN = { preview: 'shibo.openPreview', show: 'shibo.showNode', follow: 'shibo.followText', unfollow: 'shibo.unfollowText', restart: 'shibo.restart' } as const;
/** How the server is started. */
export const ARGUMENTS = ['lsp'];
