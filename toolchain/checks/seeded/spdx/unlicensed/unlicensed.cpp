// expect: unlicensed.cpp:1: no 'SPDX
int unlicensed;
