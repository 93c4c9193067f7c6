// Entry of the workers' bundle: which of the two it is, its name says.
import { runDrawer } from './drawer';
import { runNet } from './session';

if (self.name === 'draw') runDrawer();
else runNet();
