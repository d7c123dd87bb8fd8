"""What has changed: recordings of one machine under one model, whose own nature belongs to the machine and is no finding.

machine_error (the common error of both as columns of what the model drives), change_effects (the catalogue as changes of the
new recordings' numbers), compare_recordings (the whole). Pure: time and chance are arguments.
"""
