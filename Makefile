# Two commands: `make demo` and `make test`. Both set up what is missing first.
# Everything is built in the release profile, so that dependencies are built once.

export PATH := $(PATH):$(or $(CARGO_HOME),$(HOME)/.cargo)/bin
# Every test binary shares one device among its tests; many at once only take memory. One more than there are cores,
# because tests wait for programs and windows.
export RUST_TEST_THREADS ?= $(shell n=$$(nproc 2>/dev/null || echo 2); [ $$n -gt 3 ] && echo 4 || echo $$((n + 1)))
# A driver that hangs must not hang the run.
TEST_SECONDS ?= 3000
DEMO_SECONDS ?= 300
WEB_SECONDS ?= 900

.PHONY: demo test format test-more test-web test-cluster test-mesa25 test-mesa-new test-narrow audit faults corpus assets deb docs clean

demo:  ## build, render the gallery: print what each pass took, then refine the picture for two minutes at most
	scripts/setup.sh demo
	cargo build --release --locked
	mkdir -p out
	scripts/guard.sh $(DEMO_SECONDS) target/release/twobounce render assets/gallery.glb -o out/one-pass.png \
	  --size 512x512 --set voxels=64 --timings
	scripts/guard.sh $(DEMO_SECONDS) target/release/twobounce render assets/gallery.glb -o out/gallery.png \
	  --size 512x512 --set voxels=64 --time-limit 2min
	@echo "The picture: out/gallery.png; out/one-pass.png is that of the times above"

test:  ## formatting, lints, docs, every test, of Rust and of the Python package
	scripts/setup.sh test
	cargo fmt --check
	cargo clippy --release --locked --features hot-reload --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --release --locked --no-deps --lib
	RUSTDOCFLAGS="-D warnings --cfg internals" cargo doc --release --locked --no-deps --document-private-items
	cargo test --release --locked --features hot-reload --no-run
	scripts/guard.sh $(TEST_SECONDS) cargo test --release --locked --features hot-reload
	scripts/guard.sh $(TEST_SECONDS) scripts/test-python.sh

test-web:  ## the chart's page in a real browser (Debian's chromium, installed if missing)
	scripts/setup.sh web
	cargo test --release --locked --features hot-reload --no-run --test command
	scripts/guard.sh $(WEB_SECONDS) tests/web/run.sh

test-cluster:  ## docs/cluster.md's recipes, with workers that are killed (Debian's parallel and Slurm, installed if missing; HyperQueue from PyPI)
	scripts/setup.sh cluster
	cargo build --release --locked
	scripts/guard.sh $(WEB_SECONDS) tests/cluster/run.sh

format:  ## Rust and GLSL
	cargo fmt
	scripts/format-glsl.py

test-more:  ## every case of every test, also of those that build programs of their own, ten minutes of fuzzing, audit, Mesa 25, ray queries, planted faults: hours
	scripts/setup.sh test
	scripts/format-glsl.py --check
	TWOBOUNCE_TEST_MORE=1 cargo test --release --locked --features hot-reload -- --include-ignored
	TWOBOUNCE_FUZZ_SECONDS=600 cargo test --release --locked --test fuzz damaged -- --nocapture
	$(MAKE) audit test-mesa25 test-mesa-new faults

test-mesa25:  ## the same tests on Mesa 25.0.7 (Debian 12, unpacked beside), and both drivers' images compared
	scripts/setup.sh test
	cargo test --release --locked --no-run
	scripts/guard.sh $(TEST_SECONDS) scripts/mesa25.sh cargo test --release --locked
	cargo build --release --locked
	scripts/compare-drivers.sh

# Its driver for AMD's cards no longer compiles without one.
test-mesa-new:  ## the device's tests on Mesa 26 (Debian 13's backports, unpacked beside), whose software driver has ray queries
	scripts/setup.sh test
	cargo test --release --locked --features hot-reload --no-run --test device
	TWOBOUNCE_TEST_QUERIES=1 scripts/guard.sh $(TEST_SECONDS) scripts/mesa-new.sh \
	  cargo test --release --locked --features hot-reload --test device -- --skip without_a_card

# Mesa's cache does not tell widths of vectors apart (src/cli/driver_cache.rs): these tests have one of their own.
test-narrow:  ## the device's tests with vectors of 128 bits, as a CPU without AVX has, over a heap that glibc checks
	scripts/setup.sh test
	cargo test --release --locked --features hot-reload --no-run
	mkdir -p .cache/mesa-vectors-128
	MESA_SHADER_CACHE_DIR=$(CURDIR)/.cache/mesa-vectors-128 LP_NATIVE_VECTOR_WIDTH=128 LD_PRELOAD=libc_malloc_debug.so.0 \
	  MALLOC_CHECK_=3 MALLOC_PERTURB_=165 cargo test --release --locked --features hot-reload --test device

audit:  ## licences, sources and known faults of the dependencies (cargo-deny and cargo-audit, built if missing)
	scripts/setup.sh audit
	scripts/audit.sh

faults:  ## plants faults, one at a time, and writes into docs/notes/faults.md which test catches which: 40 minutes
	scripts/setup.sh test
	scripts/planted-faults.py

corpus:  ## render every model in DIR: make corpus DIR=models
	cargo build --release --locked
	scripts/corpus.sh $(DIR)

deb:  ## a package for Debian and Ubuntu: out/twobounce_*.deb (cargo-deb, built if missing)
	scripts/setup.sh deb
	scripts/deb.sh

assets:  ## write the scenes in assets/ anew
	cargo run --release --locked -- make-assets

clean:
	cargo clean
	rm -rf out
