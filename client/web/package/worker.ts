// The package's workers, each by its name.
import { runNet } from '../page/session';
import { runSocket } from '../page/socket';

if (self.name === 'socket') runSocket();
else runNet();
