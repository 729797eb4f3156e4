"""Bad values and combinations of every command: its words, its status, and what it says."""

VALUES = """
run jump --duration nan | 2 | duration is nan s
run jump --duration 1e99 | 2 | duration is 1e+99 s
run jump --duration long | 2 | Error parsing --duration: could not convert string to fl
run jump --z2 nan | 2 | set point z2 + dz2 is nan rad
run jump --dz2 inf | 2 | set point z2 + dz2 is inf rad
run jump --dz2 0 | 2 | dz2 is 0 rad
run jump --seed -1 | 2 | seed is -1; it must be 0 to 9223372036854775807
run jump --tip-radius -1 | 2 | ground: tip_radius is -1 m
run jump --tip-radius 9 | 2 | ground: tip_radius is 9 m
run jump --encoder-counts 0 | 2 | servo encoder_counts is 0 counts per revolution
run jump --motor-delay-cycles -1 0 | 2 | motor_delay_cycles is (-1, 0) cycles
run jump --stiffness-error nan 0 | 2 | stiffness_error is (nan, 0.0)
run jump --stiffness-error -1 0 | 2 | stiffness_error is (-1.0, 0.0)
run jump --mass-error -2 0 0 | 2 | mass_error is (-2.0, 0.0, 0.0)
run jump --link-noise -1 0 | 2 | link_noise is (-1.0, 0.0) rad
run jump --motor-range 1 -1 0 1 | 2 | motor_range is [1, -1] rad
run jump --boom-radius -1 --setup ffs | 2 | setup: boom_radius is -1 m
run jump --plant moon | 2 | no plant 'moon'
run jump --plant nowhere.py:Thing | 2 | nowhere.py: cannot be read: No such file or directory
run jump --set nonsense | 2 | --set nonsense: write dotted.key=value, such as controll
run jump --set plant.kind="moon" | 2 | no plant 'moon'
run jump --set design.springs.stiffness="x" | 2 | design: [springs] needs 'stiffness' = [a, b], not
run jump --set no.such.key=1 | 2 | no: unknown key
run jump --convention odd | 2 | invalid choice 'odd' for argument '--convention'. Expect
run jump --interface legbench | 2 | interface: settings of plant can
run jump --plant can --interface legbench --bitrate 0 | 2 | bitrate is 0 bit/s
run jump --plant can --interface legbench --read-only --duration -1 | 2 | duration is -1 s
replay RUN --speed 0 | 2 | speed is 0; it must be 0.001 to 1000 (0.25 is four times
replay RUN --speed nan | 2 | speed is nan
replay RUN --speed -1 | 2 | speed is -1; it must be 0.001 to 1000 (0.25 is four time
replay RUN --from 9 --to 8 | 2 | from is 9 s, to is 8 s
replay RUN --from nan | 2 | from is nan s
replay RUN --to -5 | 2 | --from, --to, --speed and --loop say how a run is played
replay RUN --beyond nan | 2 | beyond is nan
replay RUN --beyond -1 | 2 | beyond is -1
replay RUN --resimulate sideways | 2 | invalid choice 'sideways' for argument '--resimulate'. E
replay RUN --set design.springs.stiffness=3 | 2 | --set changes what is replayed
replay RUN --plant moon --resimulate commands | 2 | needs plant 'moon'
replay RUN --figure out.xyz | 2 | a figure cannot be written as 'out.xyz'
replay RUN --loop | 2 | --from, --to, --speed and --loop say how a run is played
recover RUN extra | 2 | Unrecognized options: extra
recover RUN --speed 2 | 2 | Unrecognized options: --speed, 2
render RUN --out film.xyz | 2 | a run cannot be rendered as 'film.xyz'
render RUN --out film.mp4 --speed 0 | 2 | speed is 0; it must be 0.001 to 1000 (0.25 is four times
render RUN --out film.mp4 --speed nan | 2 | speed is nan
render RUN --out still.png --time 99 | 2 | time is 99 s
render RUN --out still.png --time nan | 2 | time is nan s
render RUN --out film.mp4 --time 1 | 2 | time = 1 s draws one frame
render RUN --out film.gif --from 5 --to 4 | 2 | from is 5 s, to is 4 s
render RUN --out nowhere/film.xyz | 2 | a run cannot be rendered as 'film.xyz'
model --boom-radius nan --setup ffs | 2 | boom_radius is nan m
model --boom-radius 0 --setup ffs | 2 | boom_radius is 0 m
model --boom-radius 1 | 2 | setup jump has no boom
model --setup moon | 2 | invalid choice 'moon' for argument '--setup'. Expected o
model --linkage string | 2 | invalid choice 'string' for argument '--linkage'. Expect
model --out nowhere/leg.xml | 1 | cannot write nowhere/leg.xml: No such file or directory
design --mass nan --requirements quadruped | 2 | body mass is nan kg
design --mass 0 --requirements quadruped | 2 | body mass is 0 kg
design --mass 30 | 2 | --mass belongs to --requirements quadruped, not to 'pape
design --requirements quadruped | 2 | preset 'quadruped' needs the body's --mass [kg]
design --seed -1 | 2 | seed is -1; it must be 0 or more
design --restarts -1 | 2 | restarts is -1
design --evaluations 0 | 2 | evaluations is 0
design --evaluations -5 | 2 | evaluations is -5
design --overhang nan | 2 | overhang is nan m
design --overhang -1 | 2 | overhang is -1 m
design --legs 0 --tolerances default | 2 | legs is 0; a yield needs 1 leg or more
design --legs -1 --tolerances default | 2 | legs is -1; a yield needs 1 leg or more
design --drawing leg.xyz | 2 | a figure cannot be written as 'leg.xyz'
design --plot plot.xyz | 2 | a figure cannot be written as 'plot.xyz'
check optimal --relaxed-length nan | 2 | relaxed length is nan m
check optimal --relaxed-length 9 | 2 | relaxed length is 9 m
check optimal --relaxed-length -1 | 2 | relaxed length is -1 m
check optimal --tolerance nan | 2 | tolerance is nan
check optimal --tolerance -1 | 2 | tolerance is -1
check optimal --tolerances default --legs 0 | 2 | legs is 0; a yield needs 1 leg or more
check optimal --tolerances default --legs -2 | 2 | legs is -2; a yield needs 1 leg or more
check optimal --tolerances default --seed -1 | 2 | seed is -1; it must be 0 or more
check optimal --legs many | 2 | Error parsing --legs: invalid literal for int() with bas
modes optimal --z2 nan | 2 | set point z2 is nan rad
modes optimal --z2 9 | 2 | set point z2 = 9 rad puts the hip at -6.364 and the knee
modes optimal --energy nan | 2 | energy is nan J
modes optimal --energy -1 | 2 | energy is -1 J
modes optimal --energy 0 | 2 | energy is 0 J
modes optimal --at -1 | 2 | at is -1 J; it must be positive and finite
modes optimal --at nan | 2 | at is nan J; it must be positive and finite
modes optimal --family sideways | 2 | invalid choice 'sideways' for argument '--family'. Expec
modes optimal --setup moon | 2 | invalid choice 'moon' for argument '--setup'. Expected o
modes optimal --respond nan | 2 | respond is nan rad
modes optimal --respond -1 | 2 | respond is -1 rad
modes optimal --respond 0 | 2 | respond is 0 rad
modes optimal --ride nan | 2 | ride is nan rad
modes optimal --ride -1 | 2 | ride is -1 rad
modes optimal --threshold nan --ride 0.1 | 2 | threshold is nan N m
modes optimal --threshold -1 --ride 0.1 | 2 | threshold is -1 N m
modes optimal --reach nan | 2 | reach is nan rad
modes optimal --reach -1 | 2 | reach is -1 rad
hop optimal --height nan | 2 | height is nan m
hop optimal --height -1 | 2 | height is -1 m
hop optimal --height 0.01 | 2 | the start puts the foot 210 mm below the ground
hop optimal --hops 0 | 2 | hops is 0; it must be 1 or more
hop optimal --hops -1 | 2 | hops is -1; it must be 1 or more
hop optimal --period 0 | 2 | period is 0 hops
hop optimal --period -1 | 2 | period is -1 hops
hop optimal --family z2 | 2 | a family needs both --family, what is varied, and --to,
hop optimal --family z2 --to nan | 2 | set point z2 + dz2 is nan rad
hop optimal --family sideways --to 1 | 2 | invalid choice 'sideways' for argument '--family'. Expec
hop optimal --basin -1 | 2 | basin is -1 points a side
hop optimal --basin 1 | 2 | basin is 1 points a side
hop optimal --basin 100000 --out out | 2 | basin is 100000 x 100000 = 10000000000 cells, some 5.6e+
hop optimal --basin 10 --workers 0 --out out | 2 | workers is 0
hop optimal --basin 10 --across foo | 2 | axis 'foo' is unknown
hop optimal --basin 10 --across z1 --up z1 | 2 | both axes are z1
hop optimal --basin 10 --across-span nan | 2 | axis z1 runs from nan to nan in 10 points
hop optimal --basin 10 --across-span -1 | 2 | axis z1 runs from 1 to -1 in 10 points
hop optimal --basin 10 --up-span 0 | 2 | axis speed runs from -0 to 0 in 10 points
hop optimal --passive --basin 10 --out out | 2 | a passive leg gains no energy, so no hop draws oth
hop optimal --rest nan --passive | 2 | set point z2 is nan rad
hop optimal --z2 nan | 2 | set point z2 + dz2 is nan rad
hop optimal --dz2 -0.1 | 2 | dz2 is -0.1 rad
hop optimal --delay -5 | 2 | delay is -5 s
explain --reading novel | 2 | invalid choice 'novel' for argument '--reading'. Expecte
explain --causes nonsense | 2 | no cause 'nonsense'
explain --screen guess | 2 | invalid choice 'guess' for argument '--screen'. Expected
explain --seed -1 | 2 | seed is -1; it must be 0 to 9223372036854775807
explain --seed x | 2 | Error parsing --seed: invalid literal for int() with bas
explain --design nowhere | 2 | nowhere: no such design file
report RUN | 2 | is not there: name the folder of a campaign
report RUN --figures bmp | 2 | invalid choice 'bmp' for argument '--figures'
report RUN --out folder | 2 | is not there: name the folder of a campaign
campaign GOOD --executor moon | 2 | no executor 'moon'
campaign GOOD --executor dask:// | 2 | '' is no address of a scheduler
campaign GOOD --executor dask://nowhere | 2 | 'nowhere' is no address of a scheduler
campaign GOOD --workers 0 | 2 | workers is 0
campaign GOOD --workers -2 | 2 | workers is -2
campaign GOOD --shard 0/4 | 2 | shard is '0/4'
campaign GOOD --shard 5/4 | 2 | shard is '5/4'
campaign GOOD --shard x | 2 | shard is 'x'
campaign GOOD --set nonsense | 2 | --set nonsense: write dotted.key=value, such as controll
campaign GOOD --set no.such.key=1 | 2 | step, fixed trunk: no: unknown key
campaign GOOD --records zip | 2 | invalid choice 'zip' for argument '--records'. Expected
campaign GOOD --plant can --shard 1/2 | 2 | a bench runs one experiment after another: leave --shard
campaign GOOD --plant can --pause nan --interface legbench | 2 | pause is nan s
campaign GOOD --plant can --pause -1 --interface legbench | 2 | pause is -1 s
campaign GOOD --plant moon | 2 | invalid choice 'moon' for argument '--plant'. Expected o
drives scan --interface legbench --last 0 | 2 | last is 0; node ids are 1 to 127
drives scan --interface legbench --last 128 | 2 | last is 128; node ids are 1 to 127
drives scan --interface legbench --bitrate 0 | 2 | bitrate is 0 bit/s
drives scan --interface legbench --bitrate -5 | 2 | bitrate is -5 bit/s
drives status extra | 2 | Unrecognized options: extra
drives configure --interface legbench --bitrate 123456789 | 2 | bitrate is 123456789 bit/s
drives jog --interface legbench --node nobody | 2 | no node 'nobody' in the bus file
drives jog --interface legbench --node motor1 --by nan | 2 | a jog by nan rad
drives jog --interface legbench --node motor1 --by 3 | 2 | a jog by 3 rad
drives jog --interface legbench --node motor1 --by 0 | 2 | a jog by 0 rad
drives jog --interface legbench --node motor1 --speed 0 | 2 | a jog at 0 rad/s
drives jog --interface legbench --node motor1 --speed nan | 2 | a jog at nan rad/s
drives jog --interface legbench --node motor1 --speed 9 | 2 | a jog at 9 rad/s
drives jog | 2 | Missing from legbench drives jog: --node STR Name of the
drives home --interface legbench --node nobody --method 37 | 2 | no node 'nobody' in the bus file
drives home --interface legbench --node motor1 --method 99 | 2 | homing method is 99
drives home --interface legbench --node motor1 --method 37 --timeout nan | 2 | timeout is nan s
drives home --interface legbench --node motor1 --method 37 --timeout 0 | 2 | timeout is 0 s
drives home --interface legbench --node motor1 --method 37 --timeout -1 | 2 | timeout is -1 s
drives zero --interface legbench --posture nan 0 | 2 | an angle of the posture is nan rad
drives zero --interface legbench --posture 9 9 | 2 | an angle of the posture is 9 rad
drives zero --interface legbench --posture 0 | 2 | Missing value for argument '--posture'. Expected
drives zero --interface legbench | 2 | Missing from legbench drives zero: --posture FLOAT FLOAT
drives node-id --interface legbench --to 0 | 2 | node id is 0
drives node-id --interface legbench --to 128 | 2 | node id is 128
drives node-id --interface legbench --to x | 2 | Error parsing --to: invalid literal for int() with
drives jitter --interface legbench --cycles 0 | 2 | cycles is 0; it must be 1 or more
drives jitter --interface legbench --cycles -3 | 2 | cycles is -3
drives jitter --interface legbench --recording perhaps | 2 | invalid choice 'perhaps' for argument
drives jitter --interface legbench --plot x.bmp --cycles 10 | 2 | a figure cannot be written as 'x.
drives jitter --interface legbench --cpu -4 --cycles 10 | 2 | cpu is -4
drives budget --bitrate 0 | 2 | bitrate is 0 bit/s
drives budget --bitrate 1000 | 2 | bitrate is 1000 bit/s
drives budget --bitrate fast | 2 | Error parsing --bitrate: no type matching {None}|INT cou
drives emulate --seconds nan | 2 | seconds is nan s
drives emulate --seconds -1 | 2 | seconds is -1 s
drives emulate --patience 0 --seconds 0.1 --channel x.sock | 2 | patience is 0
drives emulate --patience -1 --seconds 0.1 --channel x.sock | 2 | patience is -1
drives emulate --only nobody --seconds 0.1 --channel x.sock | 2 | no node 'nobody' in the bus file
drives emulate --serve radio | 2 | invalid choice 'radio' for argument '--serve'. Expected
drives monitor --interface legbench --seconds nan | 2 | seconds is nan s
drives monitor --interface legbench --seconds -1 | 2 | seconds is -1 s
drives monitor --interface legbench --every 0 --seconds 0.1 | 2 | every is 0 s
drives monitor --interface legbench --every nan --seconds 0.1 | 2 | every is nan s
drives learn | 2 | Missing from legbench drives learn: PATH Data sheet of t
drives check --eds | 2 | Missing value for argument '--eds'. Expected 1 values
drives reset extra | 2 | Unrecognized options: extra
drives store --bus | 2 | Missing value for argument '--bus'. Expected 1 values
drives frobnicate | 2 | Unrecognized options: frobnicate
compare | 2 | one run has nothing to be compared with
compare RUN | 2 | one run has nothing to be compared with
compare RUN RUN --align moon | 2 | invalid choice 'moon' for argument '--align'
compare RUN RUN --align action | 1 | has 0 events of kind action
compare RUN RUN --span nan | 2 | --span is nan s
compare RUN RUN --span -1 | 2 | --span is -1 s
compare RUN RUN --figure out.xyz | 2 | a figure cannot be written as 'out.xyz'
runs nowhere | 1 | cannot list runs in nowhere
runs RUNS --where nonsense | 2 | no run has a figure or setting 'nonsense'
runs RUNS --where nosuch>3 | 2 | no run has a figure or setting 'nosuch'
runs RUNS --sort nosuch | 2 | no run has a figure or setting 'nosuch'
runs RUNS --columns nosuch | 2 | no run has a figure or setting 'nosuch'
export RUN | 2 | no format was chosen
export RUN --csv --mat | 2 | one file has one format
identify | 2 | no run to learn from
identify RUN | 2 | is in setup 'jump', where the foot lifts off
identify RUN --free nonsense | 2 | no parameter is called 'nonsense'
identify RUN --noise-deg nan | 2 | noise_deg is nan deg
identify RUN --noise-deg -1 | 2 | noise_deg is -1 deg
identify RUN --peer nobody | 2 | invalid choice 'nobody' for argument '--peer'
identify RUN --held-out nowhere | 1 | nowhere does not exist
"""
"""A line an input: words, exit status, part of the message."""
