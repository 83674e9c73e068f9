"""Many problems in one call, over threads: ``plan_many`` and the long arrays that it works on."""
