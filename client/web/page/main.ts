// Entry of the bundle, which is the page's script and its workers': a worker's name says which of them it is.
import { runDrawer } from './drawer';
import { runNet } from './session';
import { runSocket } from './socket';

if (typeof document !== 'undefined') void import('./app');
else if (self.name === 'draw') runDrawer();
else if (self.name === 'socket') runSocket();
else runNet();
