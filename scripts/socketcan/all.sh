#!/bin/sh
# All that is shown on a real SocketCAN interface; runs in the guest.
cd "$(dirname "$0")/../.." || exit 3
python=.venv/bin/python
for channel in vcan0 vcan1; do
    ip link add dev $channel type vcan && ip link set $channel up || exit 3
done
export PYTEST_DISABLE_PLUGIN_AUTOLOAD=1
$python -m pytest -c pyproject.toml -p no:cacheprovider -v -v --color=no scripts/socketcan/test_vcan.py
tests=$?
$python scripts/socketcan/cadence.py || exit 1
exit $tests
