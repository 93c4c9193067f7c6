// What users of the npm package write, as its declarations let them; and what these refuse (tests/web/page.sh compiles it).
import { connect, type State } from '../../client/web/package/strandcast';
import { StrandcastHair } from '../../client/web/package/three_hair';

export async function use(): Promise<Float32Array> {
  const connection = connect('wss://hair.example/v1', { token: 'token', role: 'viewer', head: 'anna' });
  const welcome = await connection.opened;
  const end = connection.on('state', (state: State) => console.log(state.hash.length, state.pose.rotation[3], welcome.strandCount));
  connection.on('link', ({ state, retryMs }) => console.log(state === 'waiting' ? retryMs : 0));
  end();
  connection.set('look.hair_color', 'red');
  connection.setCamera({ offset: [0, 0, 1], target: [0, 0, 0], fov: 0.6 });
  for await (const { positions, vertexCount } of connection) if (positions.length > vertexCount) return positions;
  // @ts-expect-error: a state is nobody's to change
  for await (const state of connection) state.tick = 0;
  // @ts-expect-error: there is no such event
  connection.on('picture', () => {});
  // @ts-expect-error: a role that decides nothing here
  connect('wss://hair.example', { role: 'admin' });
  // @ts-expect-error: a link has no such state
  if (connection.link.state === 'lost') connection.close();
  return new Float32Array();
}

/** What draws is what its declaration says. */
export const declared: typeof import('../../client/web/package/hair').StrandcastHair = StrandcastHair;
