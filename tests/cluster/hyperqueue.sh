# HyperQueue from PyPI, in a virtual environment of its own.
python3 -m venv venv
export PATH="$PWD/venv/bin:$PATH"
engine "HyperQueue" hyperqueue
