"""The call ``plan`` that ties everything together, and ``plan_many`` for many problems over threads."""
