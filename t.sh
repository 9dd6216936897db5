archord solve fric.toml -o /archord/runs/fric --force 2>&1 | tail -3; head -1 runs/fric/history.csv; tail -1 runs/fric/history.csv; python3 -c "
import json;r=json.load(open('runs/fric/run.json'));print({k:r[k] for k in r if 'balance' in k or 'warn' in k}); 
from archord.postprocess.run import Run
c=Run('runs/fric').contact(20)['hole']; import numpy as np
for i in range(0,c.s.shape[0],3): print(np.round([c.angle[i,0],c.raw_pressure[i,0]*1e3,c.shear[i,0]*1e3,c.sticks[i,0]],4))
"
