mkdir -p "$HOME/.parallel"
touch "$HOME/.parallel/will-cite"
engine "GNU parallel" parallel
