// Entry of the workers' bundle: which of them it is, its name says.
import { runDrawer } from './drawer';
import { runNet } from './session';
import { runSocket } from './socket';

if (self.name === 'draw') runDrawer();
else if (self.name === 'socket') runSocket();
else runNet();
