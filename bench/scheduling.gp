# build/release/bench/scheduling --csv build/scheduling.csv && gnuplot bench/scheduling.gp
set terminal svg size 720,420 font "sans,13" background "white"
set output "docs/scheduling.svg"
set datafile separator ","
set key left top
set logscale xy
set grid
set xlabel "tasks waiting"
set ylabel "one task in and out, µs"
set yrange [0.03:100]
plot "build/scheduling.csv" skip 1 using 1:3 with linespoints lw 2 pt 9 title "arbiter, a thousand tasks a second (all who wait grow older)", \
     "" skip 1 using 1:2 with linespoints lw 2 pt 7 title "arbiter (deadlines, lanes, removal)", \
     "" skip 1 using 1:4 with linespoints lw 2 pt 5 title "mutex and std::priority\\_queue"
