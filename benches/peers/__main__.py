"""Makes `python -m benches.peers` work."""

from benches.peers.run import main

raise SystemExit(main())
