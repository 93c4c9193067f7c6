// The package's workers that draw, or make ready what a page draws, each by its name.
import { runDrawer } from '../page/drawer';
import { runPrepare } from './prepare';

if (self.name === 'prepare') runPrepare();
else runDrawer();
