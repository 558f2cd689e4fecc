#!/bin/sh
# The browser of the page's tests: Debian's chromium, installed where it is missing and we are root.
command -v chromium >/dev/null && exit 0
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo 'set-up: installing chromium, which the tests of the person'"'"'s page drive (once)'
    apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends chromium >/dev/null && exit 0
fi
echo 'error: chromium is missing, and the tests of the page drive it; install it: sudo apt-get install chromium' >&2
exit 2
